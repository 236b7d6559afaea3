"""Once stretched, the tissue is softer until it is stretched farther."""

from __future__ import annotations

import operator
from dataclasses import replace

import numpy as np
from scipy.special import erf

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import (
    Direction,
    Evolution,
    Terms,
    TissueEffect,
    material_parts,
)
from defras_sim.geometry import Floats
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import TermParameter
from defras_sim.tissue.softened import Part, Softened, SofteningAhead, density_and_stress
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.terms import Term

# Where nothing has softened yet, softening is looked for with these widths beside the one given.
WIDTHS = (0.2, 0.6, 1.2)


class Softening(TissueEffect, CouponEffect):
    """First-cycle (Mullins) softening, pseudo-elastic: stress = eta dW/dF of the elastic law.

    eta = 1 - s erf((W_max - W) / (w W_max)) with W_max the largest energy density that the
    material point has seen: 1 whenever it is stretched farther than ever, lowest when it is let
    go. Ogden and Roxburgh's r, m, beta are here 1 / s, 0, w.
    """

    name = "softening"
    rank = 2
    twins = ("tissue", "coupon")
    sentence = "Once stretched, the tissue is softer until it is stretched farther."
    parameters = (
        EffectParameter(
            "share", "1", null=0.0, lower=0.0, upper=0.95, step=0.1,
            meaning="share of the stress that is lost on the way back to rest",
        ),
        EffectParameter(
            "width", "1", null=0.5, lower=0.05, upper=2.0, step=0.2, strength=False,
            meaning="way back, as a share of the largest energy, on which most of it is lost",
        ),
    )  # fmt: skip
    falsified_by = (
        "The second of two equal pulls needs the force of the first, or the tissue recovers."
    )
    excited_by = "Two equal pulls in a row, the second a little farther than the first."
    source = "R. W. Ogden, D. G. Roxburgh, Proc. R. Soc. Lond. A 455 (1999) 2861-2877."

    coupon_stage = "damage"

    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        at = self.complete(values)
        if at["share"] == 0:
            return pull
        largest = np.maximum.accumulate(pull.energy_j_m3)
        # At rest before the first pull there is no energy yet, and nothing to have lost.
        back = np.divide(
            largest - pull.energy_j_m3, largest, out=np.zeros_like(largest), where=largest > 0
        )
        eta = 1 - at["share"] * erf(back / at["width"])
        return replace(pull, stress_pa=eta * pull.stress_pa)

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Softens(values["share"], values["width"])


class _Softens(Evolution):
    """``memory`` is the largest energy density that each point has seen."""

    memory: Floats | None = None

    def __init__(self, share: float, width: float) -> None:
        self._share, self._width = share, width
        self._parts: tuple[Part, ...] = ()
        self._of: Floats | None = None
        self._term: Term | None = None
        self._widths = tuple(sorted({width, *WIDTHS}))

    def terms(self, terms: Terms) -> Terms:
        parts = material_parts(terms)
        if self.memory is None:
            self.memory = np.zeros(parts[0].points.volumes_m3.shape)
        same = len(parts) == len(self._parts) and all(map(operator.is_, parts, self._parts))
        if self._term is None or not same or self._of is not self.memory:
            self._parts, self._of = parts, self.memory
            self._term = self._made(parts, self.memory)
        if self._share == 0.0:
            return {**terms, self._term.name: self._term}
        absorbed = {part.name for part in parts}
        others = {name: term for name, term in terms.items() if name not in absorbed}
        return {self._term.name: self._term, **others}

    def after(self, time_s: float, state: TissueState) -> bool:
        F = self._parts[0].points.deformation(state.nodes_m)
        density, _ = density_and_stress(self._parts, F)
        assert self.memory is not None
        if np.any(density > self.memory):
            self.memory = np.maximum(density, self.memory)
        return False

    def directions(self) -> tuple[Direction, ...]:
        if self._share > 0.0:
            names = ("share", "width")
            return tuple(Direction(n, {}, {TermParameter("material", n): 1.0}) for n in names)
        return tuple(
            Direction("share", {"width": w}, {TermParameter("softening", f"share_{number}"): 1.0})
            for number, w in enumerate(self._widths)
        )

    def _made(self, parts: tuple[Part, ...], largest_j_m3: Floats) -> Term:
        if self._share == 0.0:
            return SofteningAhead.of(parts, largest_j_m3, self._widths)
        return Softened(parts[0].points, parts, largest_j_m3, self._share, self._width)


EFFECT = Softening()
