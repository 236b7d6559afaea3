"""Stress that the tissue has beside what its strain now makes: what it remembers, or grew into."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.material_points import MaterialPoints, MaterialTerm
from defras_sim.tissue.terms import unknown_parameter

_STRENGTH = "strength"


@dataclass(frozen=True)
class Prestress(MaterialTerm):
    """A material term: ``strength`` times the second Piola stress ``stress_pa`` at every point.

    ``stress_pa`` (elements, points, 3, 3) is symmetric. The energy density is 1/2 S:(C - I), so
    that the stress turns with the tissue. Effects of history (stress that relaxes, tissue that
    softens) put a new field in place after each solve.
    """

    points: MaterialPoints
    stress_pa: Floats
    strength: float = 1.0
    name: str = "prestress"
    parameters: tuple[str, ...] = (_STRENGTH,)

    def with_stress(self, stress_pa: Floats) -> Prestress:
        """The same term with another field."""
        return replace(self, stress_pa=stress_pa)

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        first = F @ (self.strength * self.stress_pa)
        trace = self.strength * np.trace(self.stress_pa, axis1=-2, axis2=-1)
        return 0.5 * (np.sum(first * F, axis=(-2, -1)) - trace), first

    def stress_tangent(self, F: Floats) -> Floats:
        tangent = np.zeros((*F.shape[:2], 3, 3, 3, 3))
        for i in range(3):
            tangent[:, :, i, :, i, :] = self.strength * self.stress_pa
        return tangent.reshape(*F.shape[:2], 9, 9)

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        if parameter != _STRENGTH:
            raise unknown_parameter(self, parameter)
        return F @ self.stress_pa


def second_piola_pa(F: Floats, first_piola_pa: Floats) -> Floats:
    """Second Piola stress S = F^-1 P, symmetric, of fields (elements, points, 3, 3)."""
    return np.asarray(np.linalg.solve(F, first_piola_pa), dtype=float)
