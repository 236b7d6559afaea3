"""Stress fades while the tissue is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_sim.effects.coupon_effect import CouponEffect, Pull
from defras_sim.effects.effect import Effect, EffectParameter, Values
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit


class StressRelaxation(Effect, CouponEffect):
    """Quasi-linear viscoelasticity: of each elastic stress, ``fraction`` fades within ``time_s``.

    sigma(t) = integral of G(t - s) d sigma_elastic(s), G(t) = 1 - f (1 - exp(-t / tau)). The
    elastic law is the fast one: at once after a step the model without the effect is right.
    """

    name = "stress_relaxation"
    layer = "tissue"
    twins = ("tissue", "coupon")
    sentence = "Stress fades while the tissue is held."
    parameters = (
        EffectParameter(
            "fraction", "1", null=0.0, lower=0.0, upper=0.95, step=0.1,
            meaning="share of a held stress that fades in the end",
        ),
        EffectParameter(
            "time_s", "s", null=2.0, lower=0.05, upper=5000.0, step=1.0,
            meaning="time in which it fades to 1/e of itself", strength=False,
        ),
    )  # fmt: skip
    falsified_by = (
        "The force stays while the tissue is held; or the share that fades, or the time it takes, "
        "depends on how far the tissue was stretched (then viscosity is there, but not this one)."
    )
    excited_by = "A pull within a tenth of the time, then a hold for three times as long."
    source = "Y. C. Fung, Biomechanics, 2nd ed. (1993), section 7.6."

    coupon_stage = "memory"

    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        at = self.complete(values)
        if at["fraction"] == 0:
            return pull
        fading = fading_memory(pull.time_s, pull.stress_pa, at["time_s"])
        fraction = at["fraction"]
        return replace(pull, stress_pa=(1 - fraction) * pull.stress_pa + fraction * fading)


@jit
def fading_memory(time_s: Floats, stress_pa: Floats, tau_s: float) -> Floats:
    """Integral of exp(-(t - s) / tau) d stress(s) (n,), exact where stress is linear between rows.

    Before the first row the specimen rested: a first stress that is not zero came at once.
    """
    fading = np.empty_like(stress_pa)
    fading[0] = stress_pa[0]
    for row in range(1, len(stress_pa)):
        passed = (time_s[row] - time_s[row - 1]) / tau_s
        left = np.exp(-passed)
        arriving = -np.expm1(-passed) / passed if passed > 0 else 1.0
        fading[row] = left * fading[row - 1] + arriving * (stress_pa[row] - stress_pa[row - 1])
    return fading


EFFECT = StressRelaxation()
