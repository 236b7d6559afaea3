"""What sticks the tissue's lower face to its bed, until it is pulled off.

A cohesive zone: every point of the lower face that is d away from where it stuck is pulled back
with a traction that rises to ``strength_pa`` at d = ``reach_m`` and then falls,

    t = s e (d / r) exp(-d / r),

and on the way back with the secant of the farthest it has ever been. So whatever was pulled off
stays off, and e s r (J/m^2) is the work to pull it off. J. R. Rice, G. B. Rose, J. Ferrante, J. H.
Smith's universal binding curve in the form of A. Needleman, J. Appl. Mech. 54 (1987) 525; the
secant after M. Ortiz, A. Pandolfi, Int. J. Numer. Meth. Engng 44 (1999) 1267.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.rest_shape import Face
from defras_sim.tissue.boundary import Boundary, boundary_of
from defras_sim.tissue.layout import Places
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import unknown_parameter

_STRENGTH = "strength_pa"
# Nodes of the lower face are this near to it.
_ON_FACE_M = 1e-6


@dataclass(frozen=True)
class Adhesion:
    """A boundary term on the faces ``sticking``; ``stuck_m`` (faces, points, 3) is where their
    points stuck, ``farthest_m`` (faces, points) how far away they have been."""

    sticking: Boundary
    pairs: Integers
    stuck_m: Floats
    farthest_m: Floats
    strength_pa: float
    reach_m: float
    name: str = "bed_adhesion"

    parameters = (_STRENGTH,)

    @staticmethod
    def of(
        mesh: Mesh, lower: Face, positions_m: Floats, strength_pa: float, reach_m: float
    ) -> Adhesion:
        """The ``lower`` face of ``mesh`` sticks where it is when the nodes lie at ``positions_m``.

        Raises:
            ValueError: the mesh has no face there.
        """
        edge = boundary_of(mesh)
        on_face = np.abs(mesh.nodes_m - lower.at(mesh.nodes_m[:, :2])).max(axis=1) < _ON_FACE_M
        chosen = on_face[edge.faces].all(axis=1)
        if not chosen.any():
            raise ValueError("the mesh has no faces on the tissue's lower face, by which to stick")
        part = Boundary(edge.faces[chosen], edge.values[chosen], edge.areas_m2[chosen])
        stuck = np.einsum("fqa,fai->fqi", part.values, positions_m[part.faces])
        far = np.zeros(stuck.shape[:2])
        return Adhesion(part, part.pairs(), stuck, far, strength_pa, reach_m)

    def raised(self, height_m: float) -> Adhesion:
        """The same on a bed that is ``height_m`` higher."""
        return replace(self, stuck_m=self.stuck_m + np.array([0.0, 0.0, height_m]))

    def with_farthest(self, farthest_m: Floats) -> Adhesion:
        """The same with another past."""
        return replace(self, farthest_m=farthest_m)

    def away_m(self, positions_m: Floats) -> Floats:
        """How far (faces, points) the points are from where they stuck."""
        edge = self.sticking
        now = np.einsum("fqa,fai->fqi", edge.values, positions_m[edge.faces])
        return np.asarray(np.linalg.norm(now - self.stuck_m, axis=-1))

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        gradient = np.zeros_like(positions_m)
        if self.strength_pa == 0.0:
            return 0.0, gradient
        return self._pull(self.strength_pa, positions_m, gradient), gradient

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        if self.strength_pa == 0.0:
            return
        edge = self.sticking
        where = places.reshape(*edge.faces.shape, -1, 3)
        _stiffen(
            positions_m, edge.faces, edge.values, edge.areas_m2, self.stuck_m, self.farthest_m,
            self.strength_pa, self.reach_m, where, entries,
        )  # fmt: skip

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        gradient = np.zeros_like(positions_m)
        self._pull(1.0, positions_m, gradient)
        return gradient

    def _pull(self, strength_pa: float, positions_m: Floats, gradient: Floats) -> float:
        edge = self.sticking
        return _pull(
            positions_m, edge.faces, edge.values, edge.areas_m2, self.stuck_m, self.farthest_m,
            strength_pa, self.reach_m, gradient,
        )  # fmt: skip


@jit
def _away(positions: Floats, nodes: Integers, shares: Floats, stuck: Floats, away: Floats) -> float:
    """Write a point's way from where it stuck to ``away`` (3,); return how long it is."""
    square = 0.0
    for i in range(3):
        away[i] = -stuck[i]
        for a in range(len(nodes)):
            away[i] += shares[a] * positions[nodes[a], i]
        square += away[i] * away[i]
    return math.sqrt(square)


@jit
def _pull(
    positions: Floats,
    faces: Integers,
    values: Floats,
    areas: Floats,
    stuck: Floats,
    farthest: Floats,
    strength: float,
    reach: float,
    out: Floats,
) -> float:
    """Add the gradient to ``out`` (nodes, 3); return the energy."""
    away = np.empty(3)
    energy = 0.0
    for f in range(len(faces)):
        for q in range(values.shape[1]):
            d = _away(positions, faces[f], values[f, q], stuck[f, q], away)
            far = max(d, farthest[f, q]) / reach
            secant = strength * math.e / reach * math.exp(-far)
            torn = strength * math.e * reach * (1.0 - (1.0 + far) * math.exp(-far))
            energy += areas[f, q] * (torn + 0.5 * secant * (d * d - (far * reach) ** 2))
            for a in range(faces.shape[1]):
                share = areas[f, q] * secant * values[f, q, a]
                for i in range(3):
                    out[faces[f, a], i] += share * away[i]
    return energy


@jit
def _stiffen(
    positions: Floats,
    faces: Integers,
    values: Floats,
    areas: Floats,
    stuck: Floats,
    farthest: Floats,
    strength: float,
    reach: float,
    places: np.ndarray,
    entries: Floats,
) -> None:
    """Add the second derivative to a matrix's ``entries``."""
    width = faces.shape[1]
    away = np.empty(3)
    block = np.empty((3, 3))
    for f in range(len(faces)):
        for q in range(values.shape[1]):
            d = _away(positions, faces[f], values[f, q], stuck[f, q], away)
            secant = strength * math.e / reach * math.exp(-max(d, farthest[f, q]) / reach)
            # Farther than ever, the traction grows by less than the secant, and then falls.
            less = secant / (reach * d) if d > farthest[f, q] and d > 0.0 else 0.0
            for i in range(3):
                for k in range(3):
                    block[i, k] = -less * away[i] * away[k]
                block[i, i] += secant
            for a in range(width):
                for b in range(width):
                    share = areas[f, q] * values[f, q, a] * values[f, q, b]
                    for k in range(3):
                        for i in range(3):
                            entries[places[f, a, b, k] + i] += share * block[i, k]
