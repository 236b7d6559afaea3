"""The bed under a patient's anatomy: what the tissue rests on, whatever its shape.

A plane would leave gaps under curved tissue, through which the region of interest could be seen
before anything is moved. So the bed follows the lower face at rest, as the organs under a flap do.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import gaussian_filter

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.anatomy.curved_face import CurvedFace
from defras_sim.geometry import Floats
from defras_sim.tissue.bed import CLEARANCE_M, ONSET_M, STIFFNESS_PA_PER_M
from defras_sim.tissue.layout import Places, add_blocks
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import diagonal_pairs, unknown_parameter
from defras_sim.tissue.tetrahedra import EDGES, FACES

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
    """A boundary term: a unilateral penalty on how deep nodes are below ``ground``, measured along
    z. ``stiffness_n_per_m`` (nodes,) is each node's share of the pressure; its parameter is how
    much higher the whole bed stands than the ground, ``height_m``."""

    ground: Ground
    stiffness_n_per_m: Floats
    height_m: float = 0.0
    name: str = "bed"

    @property
    def parameters(self) -> tuple[str, ...]:
        return ("height_m",)

    @cached_property
    def pairs(self) -> Integers:
        return diagonal_pairs(len(self.stiffness_n_per_m))

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        """Energy [J] and its gradient (nodes, 3) [N]; zero above the bed."""
        nodes, depth_m = self._below(positions_m)
        soft = np.minimum(depth_m, ONSET_M)
        hard = depth_m - soft
        stiffness = self.stiffness_n_per_m[nodes]
        energy = soft**3 / (6 * ONSET_M) + hard * (ONSET_M + hard) / 2
        push = stiffness * (soft**2 / (2 * ONSET_M) + hard)
        gradient = np.zeros_like(positions_m)
        gradient[nodes] = push[:, None] * self._uphill(positions_m[nodes])
        return float(stiffness @ energy), gradient

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        nodes, depth_m = self._below(positions_m)
        soft = np.minimum(depth_m, ONSET_M)
        stiffness = self.stiffness_n_per_m[nodes]
        push = stiffness * (soft**2 / (2 * ONSET_M) + depth_m - soft)
        uphill = self._uphill(positions_m[nodes])
        blocks = np.zeros((len(positions_m), 3, 3))
        blocks[nodes] = (stiffness * soft / ONSET_M)[:, None, None] * (
            uphill[:, :, None] * uphill[:, None, :]
        )
        blocks[nodes, :2, :2] += push[:, None, None] * self.ground.bend_per_m(
            positions_m[nodes, :2]
        )
        add_blocks(blocks, places, entries)

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        nodes, depth_m = self._below(positions_m)
        rate = self.stiffness_n_per_m[nodes] * np.minimum(depth_m / ONSET_M, 1.0)
        slope = np.zeros_like(positions_m)
        slope[nodes] = rate[:, None] * self._uphill(positions_m[nodes])
        return slope

    def _below(self, positions_m: Floats) -> tuple[Integers, Floats]:
        """Nodes (k,) below the bed, and how deep (k,)."""
        low = np.flatnonzero(positions_m[:, 2] < self._highest_m)
        depth = self.height_m + self.ground.height_m(positions_m[low, :2]) - positions_m[low, 2]
        return low[depth > 0], depth[depth > 0]

    @cached_property
    def _highest_m(self) -> float:
        # A cubic spline lies below the largest of its coefficients.
        return self.height_m + float(np.max(self.ground.spline.get_coeffs()))

    def _uphill(self, positions_m: Floats) -> Floats:
        """Gradient (k, 3) of the depth of nodes by their positions."""
        slope = self.ground.slope(positions_m[:, :2])
        return np.column_stack([slope, np.full(len(slope), -1.0)])


def bed_under_anatomy(mesh: Mesh, anatomy: Anatomy) -> CurvedBed:
    """The bed on which the tissue rests without touching it. Nodes of its whole surface feel it."""
    return CurvedBed(
        ground_under(anatomy.lower, mesh.nodes_m), STIFFNESS_PA_PER_M * surface_shares_m2(mesh)
    )


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


def surface_shares_m2(mesh: Mesh) -> Floats:
    """Area (nodes,) of the surface that each node of ten-node tetrahedra stands for.

    A third of a face's pressure is carried by each of its edges' middles; the corners, which the
    shape functions give nothing, get a little, so that they do not sink in: 1/12, and 1/4.
    """
    corners = mesh.connectivity[:, :4]
    faces = corners[:, FACES].reshape(-1, 3)
    middle_of = {pair: 4 + k for k, pair in enumerate(EDGES)}
    sides = [
        [middle_of[min(a, b), max(a, b)] for a, b in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0]))]
        for f in FACES
    ]
    middles = mesh.connectivity[:, sides].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = first[count == 1]
    a, b, c = np.moveaxis(mesh.nodes_m[faces[outer]], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    shares = np.zeros(len(mesh.nodes_m))
    for k in range(3):
        np.add.at(shares, faces[outer, k], area / 12)
        np.add.at(shares, middles[outer, k], area / 4)
    return shares
