"""Fibres that stiffen the tissue along one direction, and carry tension only.

W = k/2 <|F a|^2 - 1>^2 along the rest direction a, with <x> = max(x, 0): crimped or pressed fibres
buckle. To first order the modulus along a is 4 k larger in tension. After G. A. Holzapfel, T. C.
Gasser, R. W. Ogden, Journal of Elasticity 61 (2000) 1-48, without its exponential.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.material_points import MaterialPoints, MaterialTerm
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.terms import unknown_parameter

_STRENGTH, _ANGLE, _SCALE = "strength", "angle_rad", "stiffness_scale"


@dataclass(frozen=True)
class Fibres(MaterialTerm):
    """``strength`` is by how many times ``young_pa`` (elements, points), the base material's
    modulus, that along the fibres is larger; ``angle_rad`` is from x towards y.

    ``others_rad`` are angles at which there are no fibres: by ``strength_0``, ... the term can be
    differentiated by the strength of such, too.
    """

    points: MaterialPoints
    young_pa: Floats
    strength: float
    angle_rad: float
    others_rad: tuple[float, ...] = ()
    name: str = "anisotropy"
    parameters: tuple[str, ...] = (_STRENGTH, _ANGLE, _SCALE)

    def with_others(self, angles_rad: tuple[float, ...]) -> Fibres:
        """The same fibres, to be differentiated by the strength of such at ``angles_rad``, too."""
        names = tuple(other_strength(number) for number in range(len(angles_rad)))
        named = (_STRENGTH, _ANGLE, _SCALE, *names)
        return replace(self, others_rad=angles_rad, parameters=named)

    @property
    def is_nothing(self) -> bool:
        return self.strength == 0.0

    def scaled(self, factor: float) -> Fibres:
        return replace(self, young_pa=factor * self.young_pa)

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        density, stress = np.empty(F.shape[:2]), np.empty_like(F)
        _stress(F, 0.25 * self.strength * self.young_pa, _along(self.angle_rad), density, stress)
        return density, stress

    def stress_tangent(self, F: Floats) -> Floats:
        tangent = np.empty((*F.shape[:2], 9, 9))
        _tangent(F, 0.25 * self.strength * self.young_pa, _along(self.angle_rad), tangent)
        return tangent

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        if parameter == _SCALE:
            return self.density_and_stress(F)[1]
        if parameter == _ANGLE:
            return self._stress_by_angle(F)
        angles = {_STRENGTH: self.angle_rad}
        angles |= {other_strength(number): angle for number, angle in enumerate(self.others_rad)}
        one = replace(self, strength=1.0, angle_rad=angles[parameter])
        return one.density_and_stress(F)[1]

    def _stress_by_angle(self, F: Floats) -> Floats:
        """P = 2 k <x> F a (x) a with x = |F a|^2 - 1, differentiated with a turning."""
        a, turning = _along(self.angle_rad), _along(self.angle_rad + np.pi / 2)
        now, moving = F @ a, F @ turning
        excess = np.maximum(np.sum(now**2, axis=-1) - 1, 0.0)
        faster = np.where(excess > 0, 2 * np.sum(now * moving, axis=-1), 0.0)
        change = faster[..., None, None] * (now[..., :, None] * a)
        turned = moving[..., :, None] * a + now[..., :, None] * turning
        change += excess[..., None, None] * turned
        return np.asarray(0.5 * self.strength * self.young_pa[..., None, None] * change)


def other_strength(number: int) -> str:
    """The parameter that is the strength of fibres at one of the other angles."""
    return f"{_STRENGTH}_{number}"


def _along(angle_rad: float) -> Floats:
    return np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])


@jit
def _stress(F: Floats, k: Floats, a: Floats, density: Floats, P: Floats) -> None:
    """Write energy density and first Piola stress of every point."""
    along = np.empty(3)
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            excess = _stretch(F[e, q], a, along)
            density[e, q] = 0.5 * k[e, q] * excess * excess
            for i in range(3):
                for j in range(3):
                    P[e, q, i, j] = 2 * k[e, q] * excess * along[i] * a[j]


@jit
def _tangent(F: Floats, k: Floats, a: Floats, A: Floats) -> None:
    """Write dP/dF of every point."""
    along = np.empty(3)
    for e in range(F.shape[0]):
        for q in range(F.shape[1]):
            excess = _stretch(F[e, q], a, along)
            stiffness = 2 * k[e, q] if excess > 0.0 else 0.0
            for i in range(3):
                for m in range(3):
                    inner = 2 * along[i] * along[m]
                    if i == m:
                        inner += excess
                    for j in range(3):
                        for n in range(3):
                            A[e, q, 3 * i + j, 3 * m + n] = stiffness * inner * a[j] * a[n]


@jit
def _stretch(F: Floats, a: Floats, along: Floats) -> float:
    """Write F a; return <|F a|^2 - 1>."""
    square = -1.0
    for i in range(3):
        along[i] = F[i, 0] * a[0] + F[i, 1] * a[1] + F[i, 2] * a[2]
        square += along[i] * along[i]
    return max(square, 0.0)
