"""Whether an arm may be driven at all, from what it says about itself."""

from __future__ import annotations

from dataclasses import dataclass
from math import dist

import numpy as np

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_bt.dvrk.settings import Limits
from defras_bt.dvrk.transport.messages import PoseMessage

_FASTEST_M_S = 0.5
"""No tip of a dVRK that is told to go at less than half of it is this fast."""
_JUMP_M = 0.002
_PATIENCE_S = 0.1
"""So long a motion waits for messages that are late; then it ends."""


@dataclass(frozen=True)
class Standing:
    """``trip``: why motion must end now. ``wait``: why it must stand still until that is over.

    Both are sentences, "" where there is no reason.
    """

    trip: str = ""
    wait: str = ""

    @property
    def stopped(self) -> bool:
        """Whether there must be no motion now."""
        return bool(self.trip or self.wait)


class Supervisor:
    """Judges one arm once per period."""

    def __init__(self, arm: CrtkArm, limits: Limits) -> None:
        self._arm = arm
        self._limits = limits
        self._last: PoseMessage | None = None
        self._waits_since_s: float | None = None

    def judge(self, now_s: float, lost: str) -> Standing:
        """``now_s`` on the clock of the stamps; ``lost``: why the connection is gone, if it is."""
        name = self._arm.name
        trip = (
            lost or self._arm.overheard() or self._state(now_s) or self._jumped() or self._astray()
        )
        late = self._late()
        if not late:
            self._waits_since_s = None
        elif self._waits_since_s is None:
            self._waits_since_s = now_s
        elif not trip and now_s - self._waits_since_s >= _PATIENCE_S:
            trip = late
        return Standing(f"{name}: {trip}" if trip else "", late)

    def _state(self, now_s: float) -> str:
        newest = self._arm.operating_state
        state, limit_s = newest.message, self._limits.state_age_s
        if state is None:
            return "has not said yet what state it is in"
        if state.state != "ENABLED":
            return f"is {state.state}; only an arm that is ENABLED moves"
        if not state.is_homed:
            return "is not homed; home it first"
        if state.is_busy:
            return "carries out a motion that somebody else asked for"
        if limit_s is not None and now_s - state.stamp_s > limit_s:
            return f"has not said for {now_s - state.stamp_s:.2f} s what state it is in"
        return ""

    def _late(self) -> str:
        arm, limit_s = self._arm, self._limits.arm_age_s
        for fault in arm.faults():
            return fault
        for heard, what in (
            (arm.measured_cp, "measured pose"),
            (arm.setpoint_cp, "set-point"),
            (arm.jaw, "jaw"),
        ):
            age_s = heard.age_s()
            if not age_s <= limit_s:
                if heard.message is None:
                    return f"its {what} has not come yet"
                return (
                    f"its {what} is {age_s * 1e3:.0f} ms old; at most {limit_s * 1e3:g} ms are "
                    "allowed"
                )
        return ""

    def _jumped(self) -> str:
        now, last = self._arm.measured_cp.message, self._last
        self._last = now
        if now is None or last is None or now is last:
            return ""
        if not np.isfinite(now.pose.position_m).all() or not np.isfinite(now.pose.rotation).all():
            return "its measured pose is not a number"
        moved_m = dist(now.pose.position_m, last.pose.position_m)
        if moved_m > _JUMP_M + _FASTEST_M_S * (now.stamp_s - last.stamp_s):
            return f"its measured pose jumped by {moved_m * 1e3:.1f} mm"
        return ""

    def _astray(self) -> str:
        measured = self._arm.measured_cp.message
        setpoint = None if measured is None else self._arm.setpoint_cp.at(measured.stamp_s)
        if measured is None or setpoint is None:
            return ""
        away_m = dist(measured.pose.position_m, setpoint.pose.position_m)
        if away_m <= self._limits.following_m:
            return ""
        return (
            f"does not follow: it is {away_m * 1e3:.1f} mm away from its set-point, at most "
            f"{self._limits.following_m * 1e3:g} mm are allowed"
        )
