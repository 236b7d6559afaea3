"""The tissue gets stiffer the farther it is stretched."""

from __future__ import annotations

from dataclasses import replace

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.tissue_effect import (
    Direction,
    Evolution,
    Terms,
    TissueEffect,
    base_material,
)
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import TermParameter
from defras_sim.tissue.stiffening import Stiffening


class StrainStiffening(TissueEffect, CouponEffect):
    """Yeoh's second term: W = C10 (I1 - 3) + C20 (I1 - 3)^2 with C10 = mu / 2 and C20 = c C10.

    I1 is that of the isochoric deformation: at rest neither the shear nor the bulk modulus
    changes. The stress of a neo-Hookean specimen is multiplied by 1 + 2 c (I1 - 3).
    """

    name = "strain_stiffening"
    rank = 1
    twins = ("tissue", "coupon")
    sentence = "The tissue gets stiffer the farther it is stretched."
    parameters = (
        EffectParameter(
            "coefficient", "1", null=0.0, lower=0.0, upper=20.0, step=0.1,
            meaning="second by first constant of Yeoh's law, C20 / C10",
        ),
    )  # fmt: skip
    falsified_by = "The ratio of measured to modelled force does not rise with stretch."
    excited_by = "One slow pull to a large stretch, with the force measured."
    source = "O. H. Yeoh, Rubber Chemistry and Technology 66 (1993) 754-771."

    coupon_stage = "elastic"

    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        coefficient = self.complete(values)["coefficient"]
        excess = pull.invariant
        return replace(
            pull,
            energy_j_m3=pull.energy_j_m3 * (1 + coefficient * excess),
            stress_pa=pull.stress_pa * (1 + 2 * coefficient * excess),
        )

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return Stiffened(values["coefficient"])


class Stiffened(Evolution):
    """Yeoh's second term beside the base material, as stiff as that is at each point."""

    def __init__(self, coefficient: float) -> None:
        self._coefficient = coefficient
        self._made_of: ElasticBody | None = None
        self._term: Stiffening | None = None

    def terms(self, terms: Terms) -> Terms:
        body = base_material(terms)
        if self._term is None or self._made_of is not body:
            self._made_of = body
            self._term = Stiffening(body.points, body.shear_pa, self._coefficient)
        return {**terms, self._term.name: self._term}

    def directions(self) -> tuple[Direction, ...]:
        by = TermParameter("strain_stiffening", "coefficient")
        return (Direction("coefficient", {}, {by: 1.0}),)


EFFECT = StrainStiffening()
