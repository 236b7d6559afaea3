"""The stress of a specimen that is pulled along one axis.

Incompressible neo-Hookean, at the same stretch everywhere and free to contract across (Treloar,
The Physics of Rubber Elasticity, 3rd ed., section 4.4):

    W = E/6 (stretch^2 + 2/stretch - 3),    stress = E/3 (stretch - 1/stretch^2),

with E Young's modulus and stress per unstretched area; changed by the effects of the model.
"""

from __future__ import annotations

from typing import get_args

import numpy as np

from defras_sim.effects import library
from defras_sim.effects.coupon_effect import CouponEffect, CouponStage, Pull
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats


def nominal_stress_pa(
    model: Extension, young_modulus_pa: float, time_s: Floats, stretch: Floats
) -> Floats:
    """Force by unstretched area (n,) [Pa] of a specimen led through ``stretch`` (n,).

    Raises:
        ValueError: a stretch is not positive; an effect of ``model`` is unknown, cannot show in a
            specimen, or has a parameter that is unknown or out of bounds.
    """
    if not (stretch > 0).all():
        raise ValueError(f"stretch should be positive (1 at rest), is {float(np.min(stretch)):g}")
    pull = Pull(
        time_s,
        stretch,
        young_modulus_pa / 6 * (stretch**2 + 2 / stretch - 3),
        young_modulus_pa / 3 * (stretch - stretch**-2),
    )
    for stage in get_args(CouponStage):
        for name, values in model.items():
            effect = _coupon_effect(name)
            if effect.coupon_stage == stage:
                pull = effect.on_coupon(values, pull)
    return pull.stress_pa


def _coupon_effect(name: str) -> CouponEffect:
    effect = library.effect(name)
    if isinstance(effect, CouponEffect):
        return effect
    raise ValueError(f"{name} cannot show in a specimen that is pulled along one axis")
