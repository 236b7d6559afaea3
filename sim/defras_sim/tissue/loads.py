"""Loads: forces that keep their direction and size whatever the tissue does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.layout import Places
from defras_sim.tissue.material_points import MaterialPoints
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.terms import NO_PAIRS, unknown_parameter


@dataclass(frozen=True)
class DeadLoad:
    """Nodal forces ``strength`` x ``forces_n`` (nodes, 3) on the tissue.

    The energy is zero at ``rest_m`` (nodes, 3). The strength is the load's one parameter, and
    ``parameter`` its name, so that a load of strength zero has a derivative, too.
    """

    name: str
    rest_m: Floats
    forces_n: Floats
    strength: float = 1.0
    parameter: str = "strength"

    @property
    def parameters(self) -> tuple[str, ...]:
        return (self.parameter,)

    @property
    def pairs(self) -> Integers:
        return NO_PAIRS

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        if self.strength == 0.0:
            return 0.0, np.zeros_like(positions_m)
        gradient = -self.strength * self.forces_n
        return float(np.vdot(gradient, positions_m - self.rest_m)), gradient

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        """A force that does not depend on the positions has no second derivative."""

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        return -self.forces_n


def gravity(points: MaterialPoints, density_kg_m3: float, acceleration_m_s2: float) -> DeadLoad:
    """The tissue's weight, along -z, shared out by the shape functions."""
    mass_kg = density_kg_m3 * points.nodal_volumes_m3()
    pull = np.column_stack([np.zeros((len(mass_kg), 2)), -mass_kg])
    rest_m = points.mesh.nodes_m
    return DeadLoad("gravity", rest_m, pull, acceleration_m_s2, "acceleration_m_s2")
