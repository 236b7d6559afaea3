"""joint_play: a joint stays behind when its drive turns round, until the slack is taken up."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.arm_joints import JOINTS, WRIST, JointName, by_unit, unit
from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit


def width_name(joint: JointName) -> str:
    return f"{joint}_{unit(joint)}"


def share_name(joint: JointName) -> str:
    return f"{joint}_share"


def drag_name(dragged: JointName, by: JointName) -> str:
    return f"{dragged}_dragged_by_{by}"


def _of(joint: JointName) -> tuple[EffectParameter, ...]:
    width = EffectParameter(
        width_name(joint), unit(joint), null=0.0,
        lower=0.0, upper=by_unit(joint, 1.5, 0.03), step=by_unit(joint, 0.05, 0.001),
        meaning=f"what the drive of {joint} turns back before all slack is taken up",
    )  # fmt: skip
    share = EffectParameter(
        share_name(joint), "1", null=1.0, lower=0.0, upper=1.0, step=0.2,
        strength=False, amount=True,
        meaning=f"share of its lost motion that {joint} itself loses: 1 for a free gap, less where "
        "friction stretches a cable",
    )  # fmt: skip
    drags = tuple(
        EffectParameter(
            drag_name(other, joint), "1", null=0.0, lower=-1.0, upper=1.0, step=0.2,
            strength=False, amount=True,
            meaning=f"share of the lost motion of {joint} by which {other} is moved: their cables "
            "run through the shaft together",
        )
        for other in (WRIST if joint in WRIST else ())
        if other != joint
    )  # fmt: skip
    return (width, share, *drags)


class JointPlay(ArmEffect):
    """Lost motion b = q - play(q), within half the width w either side; q_j loses its share of it.

    play(q) follows q only as far as it must to stay within w / 2. Where dry friction stretches
    a cable, the joint loses a part of it, and joints that the cable passes are dragged along.
    """

    name = "joint_play"
    twins = ("tissue", "arm")
    sentence = "A joint stays behind when its drive turns round, until the slack is taken up."
    parameters = tuple(p for q in JOINTS for p in _of(q))
    falsified_by = "The error of the joint is the same on the way there and on the way back."
    excited_by = "Moving the joint to and fro by several times its play, slowly."
    source = (
        "M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), section 2; "
        "Hwang et al. 2020, arXiv 2003.08520."
    )
    place = 1

    def joints(self, values: Values, time_s: Floats, joints: Floats) -> Floats:
        own = self.complete(values)
        moved = joints.astype(float)
        for column, joint in enumerate(JOINTS):
            width = own[width_name(joint)]
            if width == 0:
                continue
            lost = lost_motion(np.ascontiguousarray(joints[:, column], float), width)
            moved[:, column] -= own[share_name(joint)] * lost
            for other, name in enumerate(JOINTS):
                drag = own.get(drag_name(name, joint), 0.0)
                if drag:
                    moved[:, other] += drag * lost
        return moved


@jit
def lost_motion(drive: Floats, width: float) -> Floats:
    """What an output behind a gap of ``width`` is away from its drive (n,); the first row is in
    the middle of the gap."""
    lost = np.empty_like(drive)
    output = drive[0]
    for row in range(len(drive)):
        output = min(max(output, drive[row] - 0.5 * width), drive[row] + 0.5 * width)
        lost[row] = drive[row] - output
    return lost


EFFECT = JointPlay()
