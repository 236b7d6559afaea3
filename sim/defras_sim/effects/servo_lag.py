"""servo_lag: a joint gets where it is told to be, but late."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.arm_joints import JOINTS
from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats


class ServoLag(ArmEffect):
    """True joints are those commanded some time ago, linear between commands.

    Behind a position loop a joint that moves steadily is late by one time, whatever its speed.
    """

    name = "servo_lag"
    twins = ("tissue", "arm")
    sentence = "A joint gets where it is told to be, but late."
    parameters = tuple(
        EffectParameter(
            f"{q}_s", "s", null=0.0, lower=0.0, upper=0.5, step=0.01,
            meaning=f"time by which {q} is late",
        )
        for q in JOINTS
    )  # fmt: skip
    falsified_by = "The error of the joint is there at rest too, or does not grow with its speed."
    excited_by = "Moving the joint to and fro at different speeds."
    source = "Lag of setpoint_js to measured_js of a dVRK arm; arXiv 2406.07375 has such motions."
    place = 0
    encoders_see = True

    def joints(self, values: Values, time_s: Floats, joints: Floats) -> Floats:
        own = self.complete(values)
        late = joints.astype(float)
        for column, parameter in enumerate(self.parameters):
            lag_s = own[parameter.name]
            if lag_s > 0:
                # Before its first command a joint stood where that command finds it.
                late[:, column] = np.interp(time_s - lag_s, time_s, joints[:, column])
        return late


EFFECT = ServoLag()
