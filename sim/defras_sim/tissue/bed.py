"""The bed under the tissue: rigid, frictionless, and only ever pushing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import Tissue
from defras_sim.tissue.boundary import Boundary, boundary_of
from defras_sim.tissue.layout import Places
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import unknown_parameter

# Pressure per depth. A fold, or a pull beside an attachment, presses with a few kilopascal at most,
# which then costs a tenth of a millimetre.
STIFFNESS_PA_PER_M = 3e7
# The resting tissue does not touch: contact that flickers on and off would slow every solve.
CLEARANCE_M = 5e-5
# The stiffness sets in over this depth, so that the tangent has no jumps.
ONSET_M = 2e-4
# No point of a quadratic face is farther below its lowest node than so many times the difference of
# its highest and lowest: what the negative ones of its shape functions add up to, at most.
_BULGE = 1.0


@dataclass(frozen=True)
class Bed:
    """A boundary term: pressure on whatever part of the tissue's surface is below ``height_m``.

    The pressure grows with the depth. It is integrated over the ``boundary``, so that it acts
    between the nodes, too, and does not depend on the mesh; folded tissue touches with its upper
    face. ``pairs`` are those of each face's nodes. Its parameter is the height.
    """

    height_m: float
    boundary: Boundary
    pairs: Integers
    name: str = "bed"

    @staticmethod
    def under(boundary: Boundary, height_m: float) -> Bed:
        """The bed with its surface at z = ``height_m``."""
        return Bed(height_m, boundary, boundary.pairs())

    @property
    def parameters(self) -> tuple[str, ...]:
        return ("height_m",)

    def raised(self, height_m: float) -> Bed:
        """The same bed, ``height_m`` higher."""
        return replace(self, height_m=self.height_m + height_m)

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        """Energy [J] and its gradient (nodes, 3) [N]; zero above the bed."""
        gradient = np.zeros_like(positions_m)
        edge = self.boundary
        energy = _press(
            positions_m, self.height_m, edge.faces, edge.values, edge.areas_m2, gradient
        )
        return energy, gradient

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        edge = self.boundary
        where = places.reshape(*edge.faces.shape, -1, 3)
        _stiffen(positions_m, self.height_m, edge.faces, edge.values, edge.areas_m2, where, entries)

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        slope = np.zeros_like(positions_m)
        edge = self.boundary
        _press_by_height(positions_m, self.height_m, edge.faces, edge.values, edge.areas_m2, slope)
        return slope

    def deepest_m(self, positions_m: Floats) -> float:
        """How far the surface reaches below the bed, at most: at a node or at a point between."""
        edge = self.boundary
        heights = positions_m[:, 2][edge.faces]
        between = np.einsum("fqa,fa->fq", edge.values, heights)
        return max(0.0, self.height_m - min(float(heights.min()), float(between.min())))


def bed_under(mesh: Mesh, tissue: Tissue) -> Bed:
    """The bed on which the tissue lies."""
    return Bed.under(boundary_of(mesh), -tissue.thickness_m - CLEARANCE_M)


@jit
def _depth(heights: Floats, shares: Floats, bed: float) -> float:
    """How far a point of a face is below the bed; negative above."""
    z = 0.0
    for a in range(len(shares)):
        z += shares[a] * heights[a]
    return bed - z


@jit
def _touches(positions: Floats, nodes: Integers, bed: float, heights: Floats) -> bool:
    """Write the heights of a face's ``nodes``; whether the face may be below the bed."""
    lowest, highest = np.inf, -np.inf
    for a in range(len(nodes)):
        heights[a] = positions[nodes[a], 2]
        lowest, highest = min(lowest, heights[a]), max(highest, heights[a])
    return lowest - _BULGE * (highest - lowest) < bed


@jit
def _press(
    positions: Floats, bed: float, faces: Integers, values: Floats, areas: Floats, out: Floats
) -> float:
    """Add the gradient to ``out`` (nodes, 3); return the energy."""
    heights = np.empty(faces.shape[1])
    energy = 0.0
    for f in range(len(faces)):
        if not _touches(positions, faces[f], bed, heights):
            continue
        for q in range(values.shape[1]):
            depth = _depth(heights, values[f, q], bed)
            if depth <= 0.0:
                continue
            # Twice integrated from the tangent, which rises from 0 to 1 over the onset.
            soft = min(depth, ONSET_M)
            hard = depth - soft
            scale = STIFFNESS_PA_PER_M * areas[f, q]
            energy += scale * (soft**3 / (6 * ONSET_M) + hard * (ONSET_M + hard) / 2)
            force = scale * (soft**2 / (2 * ONSET_M) + hard)
            for a in range(faces.shape[1]):
                out[faces[f, a], 2] -= force * values[f, q, a]
    return energy


@jit
def _press_by_height(
    positions: Floats, bed: float, faces: Integers, values: Floats, areas: Floats, out: Floats
) -> None:
    """Add the gradient's derivative by the bed's height to ``out`` (nodes, 3)."""
    heights = np.empty(faces.shape[1])
    for f in range(len(faces)):
        if _touches(positions, faces[f], bed, heights):
            for q in range(values.shape[1]):
                depth = max(_depth(heights, values[f, q], bed), 0.0)
                stiffness = STIFFNESS_PA_PER_M * areas[f, q] * min(depth / ONSET_M, 1.0)
                for a in range(faces.shape[1]):
                    out[faces[f, a], 2] -= stiffness * values[f, q, a]


@jit
def _stiffen(
    positions: Floats,
    bed: float,
    faces: Integers,
    values: Floats,
    areas: Floats,
    places: np.ndarray,
    entries: Floats,
) -> None:
    """Add the second derivative to a matrix's ``entries``."""
    width = faces.shape[1]
    heights = np.empty(width)
    for f in range(len(faces)):
        if not _touches(positions, faces[f], bed, heights):
            continue
        for q in range(values.shape[1]):
            depth = _depth(heights, values[f, q], bed)
            if depth <= 0.0:
                continue
            stiffness = STIFFNESS_PA_PER_M * areas[f, q] * min(depth / ONSET_M, 1.0)
            for a in range(width):
                for b in range(width):
                    share = stiffness * values[f, q, a] * values[f, q, b]
                    entries[places[f, a, b, 2] + 2] += share
