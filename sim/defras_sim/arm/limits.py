"""How far a motion may go before a joint of a PSM leaves its limits or moves too fast.

The remote centre of motion is part of it: its limits are those of yaw, pitch and insertion, with
the shaft's end kept beyond the cannula.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.arm.broken_joint import NONE, UNDETERMINED, broken_joint
from defras_sim.arm.closed_form import Undetermined, joints_at, turned_back
from defras_sim.arm.dh import (
    INSERTION,
    JOINT_HIGH,
    JOINT_LOW,
    JOINT_NAMES,
    JOINT_SPEED,
    SHAFT_BEYOND_RCM_M,
)
from defras_sim.geometry import Floats, Pose

LOW = JOINT_LOW.copy()
LOW[INSERTION] = SHAFT_BEYOND_RCM_M
_ROLL = JOINT_NAMES.index("roll")
_HALVINGS = 10


@dataclass(frozen=True)
class AllowedMotion:
    """``share`` (0..1) of a motion that may be carried out; ``reason`` "" where that is all."""

    share: float
    reason: str


class ArmLimits:
    """The limits of one arm whose remote centre stands at ``rcm_m`` (3,) in the tissue frame."""

    def __init__(self, rcm_m: Floats) -> None:
        self._rcm_m = np.asarray(rcm_m, float)

    def allowed(
        self, tip: Pose, linear_m: Floats, angular_rad: Floats, time_s: float
    ) -> AllowedMotion:
        """How much of a straight motion in ``time_s`` keeps the limits.

        A joint that is outside already may only go back. Found by bisection, to a thousandth of
        the motion.

        Args:
            tip: tissue_from_tip at the start.
            linear_m: displacement (3,) of the tip, tissue frame.
            angular_rad: turn (3,) of the tip as a rotation vector, tissue frame.
            time_s: how long it takes.
        """

        try:
            reason = self._broken(tip, linear_m, angular_rad, time_s)
            if not reason:
                return AllowedMotion(1.0, "")
            low, high = 0.0, 1.0
            for _ in range(_HALVINGS):
                middle = (low + high) / 2
                if self._broken(tip, middle * linear_m, middle * angular_rad, time_s):
                    high = middle
                else:
                    low = middle
        except Undetermined as error:
            return AllowedMotion(0.0, str(error))
        return AllowedMotion(low, reason)

    def _broken(self, tip: Pose, linear_m: Floats, angular_rad: Floats, time_s: float) -> str:
        """Which limit a motion breaks; "" if none."""
        end = tip.moved(linear_m, angular_rad)
        start_m, end_m = tip.position_m - self._rcm_m, end.position_m - self._rcm_m
        joint, too_fast, start, after = broken_joint(
            tip.rotation, start_m, end.rotation, end_m, LOW, JOINT_HIGH, JOINT_SPEED, time_s
        )
        if joint == NONE:
            return ""
        if joint == UNDETERMINED:
            # One of both raises, and says at which place.
            joints_at(start_m, tip.rotation)
            joints_at(end_m, end.rotation)
        name, high, speed = JOINT_NAMES[joint], JOINT_HIGH[joint], JOINT_SPEED[joint]
        if too_fast:
            unit, moved = "m/s" if joint == INSERTION else "rad/s", after - start
            moved = turned_back(moved) if joint == _ROLL else moved
            return f"{name} would move at {abs(moved) / time_s:.2f} {unit}, allowed are {speed:.2f}"
        unit, scale = ("mm", 1e3) if joint == INSERTION else ("degrees", 180 / np.pi)
        return (
            f"{name} would go to {after * scale:.1f} {unit}, allowed are "
            f"{LOW[joint] * scale:.1f} to {high * scale:.1f}"
        )
