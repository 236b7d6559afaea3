"""Tissue that gets stiffer the farther it is stretched: Yeoh's second term.

Beside the base material, W = k (I - 3)^2 with k = C20 and I = J^(-2/3) tr C, the first invariant
of the isochoric deformation: at rest neither the shear nor the bulk modulus changes. Where tissue
is turned inside out (J <= 0) the energy is infinite.
O. H. Yeoh, Rubber Chemistry and Technology 66 (1993) 754-771.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.material_points import MaterialPoints, MaterialTerm
from defras_sim.tissue.matrices import cofactor, jit
from defras_sim.tissue.terms import unknown_parameter

_COEFFICIENT, _SCALE = "coefficient", "stiffness_scale"


@dataclass(frozen=True)
class Stiffening(MaterialTerm):
    """``coefficient`` is C20 / C10; C10 is half of ``shear_pa`` (elements, points), the base
    material's shear modulus."""

    points: MaterialPoints
    shear_pa: Floats
    coefficient: float
    name: str = "strain_stiffening"

    parameters = (_COEFFICIENT, _SCALE)

    @property
    def is_nothing(self) -> bool:
        return self.coefficient == 0.0

    def scaled(self, factor: float) -> Stiffening:
        return replace(self, shear_pa=factor * self.shear_pa)

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        density, stress = np.empty(F.shape[:2]), np.empty_like(F)
        _stress(F, 0.5 * self.coefficient * self.shear_pa, density, stress)
        return density, stress

    def stress_tangent(self, F: Floats) -> Floats:
        tangent = np.empty((*F.shape[:2], 9, 9))
        _tangent(F, 0.5 * self.coefficient * self.shear_pa, tangent)
        return tangent

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        if parameter == _COEFFICIENT:
            return replace(self, coefficient=1.0).density_and_stress(F)[1]
        return self.density_and_stress(F)[1]


@jit
def _invariant(F: Floats, G: Floats, D: Floats) -> float:
    """Write F^-T to ``G`` and the invariant's derivative by F to ``D``; return it less 3."""
    J = cofactor(F, G)
    if not J > 0.0:
        return np.inf
    trace = 0.0
    for i in range(3):
        for j in range(3):
            trace += F[i, j] * F[i, j]
            G[i, j] /= J
    shrink = J ** (-2.0 / 3.0)
    for i in range(3):
        for j in range(3):
            D[i, j] = shrink * (2 * F[i, j] - 2.0 / 3.0 * trace * G[i, j])
    return shrink * trace - 3.0


@jit
def _stress(F: Floats, k: Floats, density: Floats, P: Floats) -> None:
    """Write energy density and first Piola stress of every point."""
    G = np.empty((3, 3))
    D = np.empty((3, 3))
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            excess = _invariant(F[e, q], G, D)
            density[e, q] = k[e, q] * excess * excess
            for i in range(3):
                for j in range(3):
                    P[e, q, i, j] = 2 * k[e, q] * excess * D[i, j]


@jit
def _tangent(F: Floats, k: Floats, A: Floats) -> None:
    """Write dP/dF of every point: 2 k (D (x) D + (I - 3) d2I/dF2)."""
    G = np.empty((3, 3))
    D = np.empty((3, 3))
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            f, a = F[e, q], A[e, q]
            excess = _invariant(f, G, D)
            invariant = excess + 3.0
            trace = 0.0
            for i in range(3):
                for j in range(3):
                    trace += f[i, j] * f[i, j]
            shrink = invariant / trace
            for i in range(3):
                for j in range(3):
                    for m in range(3):
                        for n in range(3):
                            bend = (
                                2.0 / 3.0 * invariant * G[i, n] * G[m, j]
                                - 4.0 / 3.0 * shrink * f[i, j] * G[m, n]
                                - 2.0 / 3.0 * G[i, j] * D[m, n]
                            )
                            if i == m and j == n:
                                bend += 2 * shrink
                            a[3 * i + j, 3 * m + n] = (
                                2 * k[e, q] * (D[i, j] * D[m, n] + excess * bend)
                            )
