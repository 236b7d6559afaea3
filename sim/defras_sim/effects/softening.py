"""Once stretched, the tissue is softer until it is stretched farther."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import erf

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import Effect, EffectParameter, Values


class Softening(Effect, CouponEffect):
    """First-cycle (Mullins) softening, pseudo-elastic: stress = eta dW/dF of the elastic law.

    eta = 1 - s erf((W_max - W) / (w W_max)) with W_max the largest energy density that the
    material point has seen: 1 whenever it is stretched farther than ever, lowest when it is let
    go. Ogden and Roxburgh's r, m, beta are here 1 / s, 0, w.
    """

    name = "softening"
    layer = "tissue"
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


EFFECT = Softening()
