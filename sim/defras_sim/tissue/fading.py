"""Stress that fades: quasi-linear viscoelasticity, from one solve to the next.

Of each elastic stress S a share f fades within tau: S_total = (1 - f) S + f H, with H the integral
of exp(-(t - s) / tau) dS(s). If S is linear in time between two solves, dt apart, then exactly

    H = e H_before + g (S - S_before),    e = exp(-dt / tau),    g = (1 - e) tau / dt,

so that S_total = (1 - f + f g) S + f (e H_before - g S_before): the elastic terms with a factor,
and a prestress. However long dt is, this neither drifts nor becomes unstable. S is the second Piola
stress, so that what is remembered turns with the tissue.

Y. C. Fung, Biomechanics, 2nd ed. (1993), section 7.6; R. L. Taylor, K. S. Pister, G. L. Goudreau,
Int. J. Numer. Meth. Engng 2 (1970) 45-59.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.material_points import MaterialPoints
from defras_sim.tissue.prestress import Prestress
from defras_sim.tissue.softened import Part, density_and_stress
from defras_sim.tissue.terms import unknown_parameter


@dataclass(frozen=True)
class Step:
    """A stretch of time of ``passed`` time constants since the last solve."""

    passed: float

    @property
    def left(self) -> float:
        """What is left of the memory: e."""
        return float(np.exp(-self.passed))

    @property
    def arriving(self) -> float:
        """What is left of stress that arrived evenly meanwhile: g."""
        return float(-np.expm1(-self.passed) / self.passed) if self.passed > 0 else 1.0

    def memory(self, before_pa: Floats, change_pa: Floats) -> Floats:
        """H after the step."""
        return self.left * before_pa + self.arriving * change_pa


@dataclass(frozen=True)
class Fading(Prestress):
    """The prestress of fading stress: ``strength`` is f, ``stress_pa`` is e H_before - g S_before.

    Beside the strength it has the parameters ``fraction`` and ``fraction_0``, ...: derivatives by
    the share that fades, as long as there is none, for each of ``ahead``: what the prestress
    would be by then, and g. ``elastic`` are the terms without factor.
    """

    elastic: tuple[Part, ...] = ()
    ahead: tuple[tuple[Floats, float], ...] = ()
    name: str = "stress_relaxation"
    parameters: tuple[str, ...] = ()

    @staticmethod
    def of(
        points: MaterialPoints,
        elastic: Sequence[Part],
        fraction: float,
        ahead: Sequence[tuple[Floats, float]],
    ) -> Fading:
        """The prestress of the first of ``ahead``."""
        named = tuple(f"fraction_{number}" for number in range(len(ahead)))
        parameters = ("stiffness_scale", *named)
        return Fading(
            points,
            ahead[0][0],
            fraction,
            elastic=tuple(elastic),
            ahead=tuple(ahead),
            parameters=parameters,
        )

    @property
    def is_nothing(self) -> bool:
        return self.strength == 0.0

    def scaled(self, factor: float) -> Fading:
        return replace(self, stress_pa=factor * self.stress_pa)

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        if parameter == "stiffness_scale":
            return F @ (self.strength * self.stress_pa)
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        prestress_pa, arriving = self.ahead[self.parameters.index(parameter) - 1]
        _, elastic = density_and_stress(self.elastic, F)
        return F @ prestress_pa + (arriving - 1) * elastic
