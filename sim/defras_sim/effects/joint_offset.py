"""joint_offset: a joint stands beside where it is believed to stand, always by as much."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.arm_joints import JOINTS, by_unit, unit
from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats


class JointOffset(ArmEffect):
    """True joints are those commanded plus a constant each."""

    name = "joint_offset"
    twins = ("tissue", "arm")
    sentence = "A joint stands beside where it is believed to stand, always by as much."
    parameters = tuple(
        EffectParameter(
            f"{q}_{unit(q)}", unit(q), null=0.0,
            lower=-by_unit(q, 0.6, 0.03), upper=by_unit(q, 0.6, 0.03), step=by_unit(q, 0.02, 0.001),
            meaning=f"where {q} truly stands less where it is commanded to",
        )
        for q in JOINTS
    )  # fmt: skip
    falsified_by = "The error of the joint depends on where it stands or where it came from."
    excited_by = "Any motion; several poses tell it from a coupling."
    source = "Hwang et al. 2020, arXiv 2003.08520, section IV."
    place = 3

    def joints(self, values: Values, time_s: Floats, joints: Floats) -> Floats:
        own = self.complete(values)
        return joints + np.array([own[p.name] for p in self.parameters])


EFFECT = JointOffset()
