"""The tissue gets stiffer the farther it is stretched."""

from __future__ import annotations

from dataclasses import replace

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import Effect, EffectParameter, Values


class StrainStiffening(Effect, CouponEffect):
    """Yeoh's second term: W = C10 (I1 - 3) + C20 (I1 - 3)^2 with C10 = mu / 2 and C20 = c C10.

    I1 is that of the isochoric deformation: at rest neither the shear nor the bulk modulus
    changes. The stress of a neo-Hookean specimen is multiplied by 1 + 2 c (I1 - 3).
    """

    name = "strain_stiffening"
    layer = "tissue"
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


EFFECT = StrainStiffening()
