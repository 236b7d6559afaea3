"""The bed under the tissue: rigid, frictionless, and only ever pushing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import Tissue
from defras_sim.tissue.layout import Places, add_blocks
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import diagonal_pairs, unknown_parameter

# Pressure per depth. A retraction presses with a few hundred pascal at most, which then costs a
# few tenths of a millimetre.
STIFFNESS_PA_PER_M = 8e6
# The resting tissue does not touch: contact that flickers on and off would slow every solve.
CLEARANCE_M = 5e-5
# The pressure sets in smoothly over this depth, which Newton's method rewards: the slowest solves
# of a retraction take half as long.
ONSET_M = 5e-4


@dataclass(frozen=True)
class Bed:
    """A boundary term: a unilateral penalty on the depth of the nodes below ``height_m``.

    ``stiffness_n_per_m`` (nodes,) is each node's share of the pressure. Its parameter is the
    height.
    """

    height_m: float
    stiffness_n_per_m: Floats
    name: str = "bed"

    @property
    def parameters(self) -> tuple[str, ...]:
        return ("height_m",)

    @property
    def pairs(self) -> Integers:
        return diagonal_pairs(len(self.stiffness_n_per_m))

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        """Energy [J] and its gradient (nodes, 3) [N]; zero above the bed."""
        depth_m = self._depth_m(positions_m)
        soft = np.minimum(depth_m, ONSET_M)
        hard = depth_m - soft
        # Twice integrated from the tangent, which rises from 0 to 1 over the onset.
        force = soft**2 / (2 * ONSET_M) + hard
        energy = soft**3 / (6 * ONSET_M) + hard * (ONSET_M + hard) / 2
        gradient = np.zeros_like(positions_m)
        gradient[:, 2] = -self.stiffness_n_per_m * force
        return float(self.stiffness_n_per_m @ energy), gradient

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        blocks = np.zeros((len(positions_m), 3, 3))
        blocks[:, 2, 2] = self._stiffness_now_n_per_m(positions_m)
        add_blocks(blocks, places, entries)

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        slope = np.zeros_like(positions_m)
        slope[:, 2] = -self._stiffness_now_n_per_m(positions_m)
        return slope

    def _stiffness_now_n_per_m(self, positions_m: Floats) -> Floats:
        """Second derivative (nodes,) along z; the rest of it is zero."""
        return self.stiffness_n_per_m * np.minimum(self._depth_m(positions_m) / ONSET_M, 1.0)

    def _depth_m(self, positions_m: Floats) -> Floats:
        return np.maximum(0.0, self.height_m - positions_m[:, 2])


def bed_under(mesh: Mesh, tissue: Tissue) -> Bed:
    """The bed on which the slab lies. Nodes of both faces feel it: folded tissue turns over."""
    lower = int(np.sum(mesh.nodes_m[:, 2] < -tissue.thickness_m * (1 - 1e-9)))
    share = STIFFNESS_PA_PER_M * tissue.length_x_m * tissue.width_y_m / lower
    return Bed(-tissue.thickness_m - CLEARANCE_M, np.full(len(mesh.nodes_m), share))
