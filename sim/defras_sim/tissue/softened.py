"""A material that has lost stress where it was stretched farther before: Mullins softening.

With W the energy density that the material has without it, and W_max the largest that each point
has seen, stress and tangent are

    P = eta dW/dF,    dP/dF = eta d2W/dF2 + d eta/dW (dW/dF) (x) (dW/dF),
    eta = 1 - s erf((W_max - W) / (w W_max)) below W_max, and 1 from there on.

That is the stress of an energy, eta integrated over W, so that equilibria are minima still. R. W.
Ogden, D. G. Roxburgh, Proc. R. Soc. Lond. A 455 (1999) 2861-2877, with r = 1 / s, m = 0, beta = w.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import erf

from defras_sim.geometry import Floats
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.material_points import MaterialPoints, MaterialTerm
from defras_sim.tissue.terms import unknown_parameter

Part = ElasticBody | MaterialTerm

_SHARE, _WIDTH, _SCALE = "share", "width", "stiffness_scale"


class _Way(NamedTuple):
    """The way back (elements, points): ``back`` is 0 from W_max on; ``span_j_m3`` is w W_max."""

    back: Floats
    span_j_m3: Floats


def density_and_stress(parts: Sequence[Part], F: Floats) -> tuple[Floats, Floats]:
    """Energy density (elements, points) and first Piola stress of all ``parts`` together."""
    densities, stresses = zip(*(part.density_and_stress(F) for part in parts), strict=True)
    return sum(densities[1:], densities[0]), sum(stresses[1:], stresses[0])


@dataclass(frozen=True)
class Softened(MaterialTerm):
    """``parts`` together, softened: ``largest_j_m3`` (elements, points) is W_max.

    Derivatives by its parameters are taken with W_max as it is.
    """

    points: MaterialPoints
    parts: tuple[Part, ...]
    largest_j_m3: Floats
    share: float
    width: float
    name: str = "material"

    parameters = (_SHARE, _WIDTH, _SCALE)

    def scaled(self, factor: float) -> Softened:
        parts = tuple(part.scaled(factor) for part in self.parts)
        return replace(self, parts=parts, largest_j_m3=factor * self.largest_j_m3)

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        density, stress = density_and_stress(self.parts, F)
        back, span = _way_back(density, self.largest_j_m3, self.width)
        lost = self.share * span * (back * erf(back) + np.expm1(-(back**2)) / np.sqrt(np.pi))
        eta = 1 - self.share * erf(back)
        return density + lost, eta[..., None, None] * stress

    def stress_tangent(self, F: Floats) -> Floats:
        density, stress = density_and_stress(self.parts, F)
        eta, eta_by = self._eta(density)
        tangents = [part.stress_tangent(F) for part in self.parts]
        tangent = eta[..., None, None] * sum(tangents[1:], tangents[0])
        flat = stress.reshape(*density.shape, 9)
        tangent += (eta_by[..., None] * flat)[..., :, None] * flat[..., None, :]
        return tangent

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        density, stress = density_and_stress(self.parts, F)
        back, _ = _way_back(density, self.largest_j_m3, self.width)
        if parameter == _SHARE:
            return -erf(back)[..., None, None] * stress
        if parameter == _WIDTH:
            steeper = 2 / np.sqrt(np.pi) * np.exp(-(back**2)) * back / self.width
            return np.asarray(self.share * steeper[..., None, None] * stress)
        if parameter == _SCALE:
            # Grown with the modulus, the largest energy leaves eta as it is.
            return self.density_and_stress(F)[1]
        raise unknown_parameter(self, parameter)

    def _eta(self, density_j_m3: Floats) -> tuple[Floats, Floats]:
        """What is left of the stress (elements, points), and its derivative by the energy."""
        back, span = _way_back(density_j_m3, self.largest_j_m3, self.width)
        slope = self.share * 2 / np.sqrt(np.pi) * np.exp(-(back**2))
        slope = np.divide(slope, span, out=np.zeros_like(span), where=(span > 0) & (back > 0))
        return 1 - self.share * erf(back), slope


@dataclass(frozen=True)
class SofteningAhead(MaterialTerm):
    """Nothing yet: what ``parts`` would lose by a first share of softening, for each of ``widths``.

    Its parameters are ``share_0``, ``share_1``, ...
    """

    points: MaterialPoints
    parts: tuple[Part, ...]
    largest_j_m3: Floats
    widths: tuple[float, ...]
    name: str = "softening"
    parameters: tuple[str, ...] = ()

    @staticmethod
    def of(
        parts: Sequence[Part], largest_j_m3: Floats, widths: tuple[float, ...]
    ) -> SofteningAhead:
        named = tuple(f"{_SHARE}_{number}" for number in range(len(widths)))
        return SofteningAhead(parts[0].points, tuple(parts), largest_j_m3, widths, parameters=named)

    @property
    def is_nothing(self) -> bool:
        return True

    def scaled(self, factor: float) -> SofteningAhead:
        parts = tuple(part.scaled(factor) for part in self.parts)
        return replace(self, parts=parts, largest_j_m3=factor * self.largest_j_m3)

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        return np.zeros(F.shape[:2]), np.zeros_like(F)

    def stress_tangent(self, F: Floats) -> Floats:
        return np.zeros((*F.shape[:2], 9, 9))

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        width = self.widths[self.parameters.index(parameter)]
        density, stress = density_and_stress(self.parts, F)
        back, _ = _way_back(density, self.largest_j_m3, width)
        return -erf(back)[..., None, None] * stress


def _way_back(density_j_m3: Floats, largest_j_m3: Floats, width: float) -> _Way:
    span = width * largest_j_m3
    way = np.maximum(largest_j_m3 - density_j_m3, 0.0)
    return _Way(np.divide(way, span, out=np.zeros_like(way), where=span > 0), span)
