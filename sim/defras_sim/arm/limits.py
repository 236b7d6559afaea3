"""How far a motion may go before a joint of a PSM leaves its limits or moves too fast.

The remote centre of motion is part of it: its limits are those of yaw, pitch and insertion, with
the shaft's end kept beyond the cannula.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
# Plain numbers: of six joints, arrays would be slower.
_LOW, _HIGH, _SPEED = LOW.tolist(), JOINT_HIGH.tolist(), JOINT_SPEED.tolist()
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

        def end(share: float) -> Floats:
            return self._joints(tip.moved(share * linear_m, share * angular_rad))

        try:
            start = self._joints(tip)
            reason = _broken(start, self._joints(tip.moved(linear_m, angular_rad)), time_s)
            if not reason:
                return AllowedMotion(1.0, "")
            low, high = 0.0, 1.0
            for _ in range(_HALVINGS):
                middle = (low + high) / 2
                if _broken(start, end(middle), time_s):
                    high = middle
                else:
                    low = middle
        except Undetermined as error:
            return AllowedMotion(0.0, str(error))
        return AllowedMotion(low, reason)

    def _joints(self, tissue_from_tip: Pose) -> Floats:
        return joints_at(tissue_from_tip.position_m - self._rcm_m, tissue_from_tip.rotation)


def _broken(start: Floats, end: Floats, time_s: float) -> str:
    """Which limit a motion from joints ``start`` (6,) to ``end`` (6,) breaks; "" if none."""
    ends = end.tolist()
    changes = [after - before for before, after in zip(start.tolist(), ends, strict=True)]
    changes[_ROLL] = turned_back(changes[_ROLL])
    for joint, (change, after, low, high) in enumerate(
        zip(changes, ends, _LOW, _HIGH, strict=True)
    ):
        if (after > high and change > 0.0) or (after < low and change < 0.0):
            unit, scale = ("mm", 1e3) if joint == INSERTION else ("degrees", 180 / np.pi)
            return (
                f"{JOINT_NAMES[joint]} would go to {after * scale:.1f} {unit}, allowed are "
                f"{low * scale:.1f} to {high * scale:.1f}"
            )
    for joint, (change, speed) in enumerate(zip(changes, _SPEED, strict=True)):
        if abs(change) > speed * time_s:
            unit = "m/s" if joint == INSERTION else "rad/s"
            return (
                f"{JOINT_NAMES[joint]} would move at {abs(change) / time_s:.2f} {unit}, "
                f"allowed are {speed:.2f}"
            )
    return ""
