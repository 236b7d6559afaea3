"""servo_lag: a joint gets where it is told to be, but late."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.arm_joints import JOINTS
from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit


class ServoLag(ArmEffect):
    """A position loop: the joint's speed is what it is away from its command, by the lag.

    A joint that moves steadily is late by that time, whatever its speed. On measured motions this
    describes a servo better than a pure delay, which hands on the command's own trembling.
    """

    name = "servo_lag"
    twins = ("tissue", "arm")
    sentence = "A joint gets where it is told to be, but late."
    parameters = tuple(
        EffectParameter(
            f"{q}_s", "s", null=0.0, lower=0.0, upper=0.5, step=0.01,
            meaning=f"time by which {q} is late in a steady motion",
        )
        for q in JOINTS
    )  # fmt: skip
    falsified_by = "The error of the joint is there at rest too, or does not grow with its speed."
    excited_by = "Moving the joint to and fro at different speeds."
    source = (
        "Velocity error of a proportional position loop; B. Siciliano et al., Robotics (2009), "
        "section 8.3. Motions of a dVRK arm: arXiv 2406.07375."
    )
    place = 0
    encoders_see = True

    def joints(self, values: Values, time_s: Floats, joints: Floats) -> Floats:
        own = self.complete(values)
        late = joints.astype(float)
        for column, parameter in enumerate(self.parameters):
            if own[parameter.name] > 0:
                command = np.ascontiguousarray(joints[:, column], float)
                late[:, column] = lagging(time_s, command, own[parameter.name])
        return late


@jit
def lagging(time_s: Floats, command: Floats, lag_s: float) -> Floats:
    """Where a joint is (n,) that follows ``command`` (n,), at rest before: exact where commands go
    straight from row to row."""
    joint = np.empty_like(command)
    joint[0] = command[0]
    for row in range(1, len(command)):
        passed = (time_s[row] - time_s[row - 1]) / lag_s
        left = np.exp(-passed)
        behind = -np.expm1(-passed) / passed if passed > 0 else 1.0
        joint[row] = (
            left * joint[row - 1] + (1 - behind) * command[row] + (behind - left) * command[row - 1]
        )
    return joint


EFFECT = ServoLag()
