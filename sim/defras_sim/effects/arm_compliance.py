"""arm_compliance: the tip gives way to the force on it, behind the encoders' back."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats

AXES = "xyz"

USUAL_REACH_M = 0.15
"""From remote centre to tip: in the middle of where a PSM works."""


def compliance_name(axis: str) -> str:
    return f"{axis}_m_per_n"


def growth_name(axis: str) -> str:
    return f"{axis}_growth_per_n"


class ArmCompliance(ArmEffect):
    """Deflection (c + g (reach - 0.15 m)) F along each axis, reach from remote centre to tip.

    A shaft and its bearing give way across the more the farther it is pushed out; along it the
    reach should not matter. Compliance is never negative.
    """

    name = "arm_compliance"
    twins = ("tissue", "arm")
    sentence = "The tip gives way to the force on it, which encoders do not see."
    parameters = tuple(
        parameter
        for axis in AXES
        for parameter in (
            EffectParameter(
                compliance_name(axis), "m/N", null=0.0, lower=0.0, upper=0.02, step=2e-4,
                meaning=f"deflection along {axis} per force, with the tip {USUAL_REACH_M:g} m from "
                "the remote centre",
            ),
            EffectParameter(
                growth_name(axis), "1/N", null=0.0, lower=-0.1, upper=0.1, step=2e-3,
                meaning=f"how much the compliance along {axis} grows for each metre of reach",
            ),
        )
    )  # fmt: skip
    falsified_by = "The tip is off as far without a force as with one."
    excited_by = "Pushing gently against something rigid along each axis, at several insertions."
    source = "Measured on a dVRK PSM: neusman1/dvrk-calibration."
    place = 4

    def tip_error(
        self, values: Values, tip_m: Floats, force_n: Floats, rcm_m: Floats
    ) -> tuple[Floats, Floats]:
        reach_m = np.linalg.norm(tip_m - rcm_m, axis=1)
        shift_m = self.deflection_m(values, reach_m, force_n)
        return shift_m, np.zeros_like(shift_m)

    def deflection_m(self, values: Values, reach_m: Floats, force_n: Floats) -> Floats:
        """Deflection (n, 3) under ``force_n`` (n, 3), the tip ``reach_m`` (n,) from the remote
        centre."""
        own = self.complete(values)
        constant = np.array([own[compliance_name(axis)] for axis in AXES])
        growth = np.array([own[growth_name(axis)] for axis in AXES])
        longer_m = np.asarray(reach_m, float)[:, None] - USUAL_REACH_M
        return np.maximum(constant + growth * longer_m, 0.0) * force_n


EFFECT = ArmCompliance()
