"""joint_coupling: a joint moves along when another one, or it itself, is moved."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.arm_joints import JOINTS, JointName, by_unit, unit
from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats


def coupling_name(driven: JointName, by: JointName) -> str:
    """Name of the parameter by which ``driven`` moves when ``by`` does."""
    return f"{driven}_from_{by}"


def _parameter(driven: JointName, by: JointName) -> EffectParameter:
    # A metre of insertion and a radian are about as rare as 0.1 m and 1 rad are common.
    scale = by_unit(driven, 1.0, 0.1) / by_unit(by, 1.0, 0.1)
    itself = " beyond what it should: an error of scale" if driven == by else ""
    return EffectParameter(
        coupling_name(driven, by), f"{unit(driven)}/{unit(by)}", null=0.0,
        lower=-scale, upper=scale, step=0.05 * scale,
        meaning=f"how far {driven} moves for each unit of {by}{itself}",
    )  # fmt: skip


class JointCoupling(ArmEffect):
    """True joints are q + K q with a constant matrix K, zero where the plain arm is right."""

    name = "joint_coupling"
    twins = ("tissue", "arm")
    sentence = "A joint moves along when another one is moved, or too far when it moves itself."
    parameters = tuple(_parameter(driven, by) for driven in JOINTS for by in JOINTS)
    falsified_by = "The error of the joint is the same wherever the other joint stands."
    excited_by = "Moving one joint at a time through its range, the others at rest."
    source = "Hwang et al. 2020, arXiv 2003.08520, section IV."
    place = 2

    def joints(self, values: Values, time_s: Floats, joints: Floats) -> Floats:
        own = self.complete(values)
        matrix = np.array([own[p.name] for p in self.parameters]).reshape(len(JOINTS), -1)
        return joints + joints @ matrix.T


EFFECT = JointCoupling()
