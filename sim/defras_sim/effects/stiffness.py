"""The tissue is stiffer or softer everywhere than its model."""

from __future__ import annotations

from dataclasses import replace

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import Effect, EffectParameter, Values


class Stiffness(Effect, CouponEffect):
    """Young's modulus is ``scale`` times the believed one, Poisson's ratio as believed."""

    name = "stiffness"
    layer = "tissue"
    twins = ("tissue", "coupon")
    sentence = "The tissue is stiffer or softer everywhere than its model."
    parameters = (
        EffectParameter(
            "scale", "1", null=1.0, lower=0.02, upper=50.0, step=0.1,
            meaning="true Young's modulus by the modelled one",
        ),
    )  # fmt: skip
    falsified_by = (
        "Forces of all motions and at all strains differ from the model's by other than one factor."
    )
    excited_by = (
        "Any pull with the force measured. Moved by displacements alone, without gravity, a "
        "uniform stiffness changes no shape, and only springs or weight beside it reveal it."
    )
    source = "Linear scaling of a hyperelastic energy; Bonet and Wood, 2nd ed., ch. 6."

    coupon_stage = "elastic"

    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        scale = self.complete(values)["scale"]
        return replace(pull, energy_j_m3=scale * pull.energy_j_m3, stress_pa=scale * pull.stress_pa)


EFFECT = Stiffness()
