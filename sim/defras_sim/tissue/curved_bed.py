"""The bed under a patient's anatomy: what the tissue rests on, whatever its shape.

A plane would leave gaps under curved tissue, through which the region of interest could be seen
before anything is moved. So the bed follows the lower face at rest, as the organs under a flap do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import gaussian_filter

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.anatomy.curved_face import CurvedFace
from defras_sim.geometry import Floats
from defras_sim.tissue.bed import CLEARANCE_M, ONSET_M, STIFFNESS_PA_PER_M
from defras_sim.tissue.boundary import Boundary, boundary_of
from defras_sim.tissue.layout import Places, add_blocks
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import unknown_parameter

# Of the grid on which the height is kept.
_PITCH_M = 0.004
# How far around the tissue the bed goes on, level with the tissue's rim.
_AROUND_M = 0.15
# Rise over run. A bed that follows steeper sides would be a mould that holds the tissue.
_STEEPEST = 1.0


@dataclass(frozen=True)
class Ground:
    """A smooth height over x and y; beyond the spline's box it goes on level."""

    spline: RectBivariateSpline

    def height_m(self, xy_m: Floats) -> Floats:
        return self._at(xy_m)

    def slope(self, xy_m: Floats) -> Floats:
        """Gradient (n, 2) of the height."""
        return np.stack([self._at(xy_m, 1, 0), self._at(xy_m, 0, 1)], axis=1)

    def bend_per_m(self, xy_m: Floats) -> Floats:
        """Second derivatives (n, 2, 2) of the height."""
        mixed = self._at(xy_m, 1, 1)
        rows = [[self._at(xy_m, 2, 0), mixed], [mixed, self._at(xy_m, 0, 2)]]
        return np.moveaxis(np.array(rows), 2, 0)

    def _at(self, xy_m: Floats, dx: int = 0, dy: int = 0) -> Floats:
        return np.asarray(self.spline.ev(xy_m[:, 0], xy_m[:, 1], dx=dx, dy=dy))


@dataclass(frozen=True)
class CurvedBed:
    """A boundary term: pressure on whatever part of the tissue's surface is below ``ground``.

    As :class:`defras_sim.tissue.bed.Bed`, with the depth measured along z. Its parameter is how
    much higher than the ground the whole bed stands, ``height_m``.
    """

    ground: Ground
    boundary: Boundary
    pairs: Integers
    height_m: float = 0.0
    name: str = "bed"

    @property
    def parameters(self) -> tuple[str, ...]:
        return ("height_m",)

    def raised(self, height_m: float) -> CurvedBed:
        """The same bed, ``height_m`` higher."""
        return replace(self, height_m=self.height_m + height_m)

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        """Energy [J] and its gradient (nodes, 3) [N]; zero above the bed."""
        below = self._below(positions_m)
        soft, hard = _split(below.depth_m)
        energy = soft**3 / (6 * ONSET_M) + hard * (ONSET_M + hard) / 2
        push = below.stiffness_n_per_m * (soft**2 / (2 * ONSET_M) + hard)
        return float(below.stiffness_n_per_m @ energy), self._spread(below, push, positions_m)

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        below = self._below(positions_m)
        if not len(below.face):
            return
        soft, hard = _split(below.depth_m)
        push = below.stiffness_n_per_m * (soft**2 / (2 * ONSET_M) + hard)
        rate = below.stiffness_n_per_m * soft / ONSET_M
        blocks = rate[:, None, None] * below.uphill[:, :, None] * below.uphill[:, None, :]
        bends = self.ground.bend_per_m(below.places_m[:, :2])
        blocks[:, :2, :2] += push[:, None, None] * bends
        # Sorted by face: those of one face are added up before they are put in the matrix.
        faces, first = np.unique(below.face, return_index=True)
        shares = below.shares[:, :, None, None, None] * below.shares[:, None, :, None, None]
        by_face = np.add.reduceat(shares * blocks[:, None, None], first, axis=0)
        width = self.boundary.faces.shape[1]
        where = places.reshape(len(self.boundary.faces), width * width, 3)[faces].reshape(-1, 3)
        add_blocks(by_face.reshape(-1, 3, 3), where, entries)

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        below = self._below(positions_m)
        rate = below.stiffness_n_per_m * _split(below.depth_m)[0] / ONSET_M
        return self._spread(below, rate, positions_m)

    def deepest_m(self, positions_m: Floats) -> float:
        """How far the surface reaches below the bed, at most."""
        return float(self._below(positions_m).depth_m.max(initial=0.0))

    def _below(self, positions_m: Floats) -> _Below:
        """The points of the boundary that are below the bed."""
        edge = self.boundary
        places = np.einsum("fqa,fad->fqd", edge.values, positions_m[edge.faces])
        face, point = np.nonzero(places[..., 2] < self._highest_m)
        places = places[face, point]
        depth = self.height_m + self.ground.height_m(places[:, :2]) - places[:, 2]
        deep = depth > 0
        face, point, places = face[deep], point[deep], places[deep]
        slope = self.ground.slope(places[:, :2])
        return _Below(
            face=face,
            shares=edge.values[face, point],
            places_m=places,
            depth_m=depth[deep],
            stiffness_n_per_m=STIFFNESS_PA_PER_M * edge.areas_m2[face, point],
            uphill=np.column_stack([slope, np.full(len(slope), -1.0)]),
        )

    def _spread(self, below: _Below, push: Floats, positions_m: Floats) -> Floats:
        """Nodal values (nodes, 3) of ``push`` (k,) on the points, along the depth's gradient."""
        each = below.shares[:, :, None] * (push[:, None] * below.uphill)[:, None, :]
        nodal = np.zeros_like(positions_m)
        np.add.at(nodal, self.boundary.faces[below.face], each)
        return nodal

    @cached_property
    def _highest_m(self) -> float:
        # A cubic spline lies below the largest of its coefficients.
        return self.height_m + float(np.max(self.ground.spline.get_coeffs()))


@dataclass(frozen=True)
class _Below:
    """Points (k,) of the boundary below the bed: their ``face``, ``shares`` (k, w) of its nodes,
    ``places_m`` (k, 3), ``depth_m`` (k,), its gradient by the place ``uphill`` (k, 3), and the
    pressure's stiffness (k,)."""

    face: Integers
    shares: Floats
    places_m: Floats
    depth_m: Floats
    stiffness_n_per_m: Floats
    uphill: Floats


def _split(depth_m: Floats) -> tuple[Floats, Floats]:
    """The part of a depth over which the stiffness sets in, and the rest."""
    soft = np.minimum(depth_m, ONSET_M)
    return soft, depth_m - soft


def bed_under_anatomy(mesh: Mesh, anatomy: Anatomy) -> CurvedBed:
    """The bed on which the tissue rests without touching it."""
    boundary = boundary_of(mesh)
    return CurvedBed(ground_under(anatomy.lower, mesh.nodes_m), boundary, boundary.pairs())


def ground_under(lower: CurvedFace, nodes_m: Floats) -> Ground:
    """The ground under a face, lowered until it clears all of ``nodes_m`` (n, 3)."""
    used = np.unique(lower.triangles)
    face_m = lower.vertices_m[used]
    low, high = face_m[:, :2].min(axis=0) - _AROUND_M, face_m[:, :2].max(axis=0) + _AROUND_M
    x, y = (np.arange(a, b + _PITCH_M, _PITCH_M) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    at = lower.at(places)  # outside, that of the nearest place of the rim
    height = at[:, 2]
    for vertex in face_m:
        away = np.linalg.norm(at[:, :2] - vertex[:2], axis=1)
        height = np.minimum(height, vertex[2] + _STEEPEST * away)
    smooth = gaussian_filter(height.reshape(len(x), len(y)), 1.0, mode="nearest")
    touching = Ground(RectBivariateSpline(x, y, smooth)).height_m(nodes_m[:, :2]) - nodes_m[:, 2]
    return Ground(RectBivariateSpline(x, y, smooth - max(0.0, touching.max()) - CLEARANCE_M))
