"""How the stand-in's time passes: with the wall, or as fast as the patient's world can.

On the real clock, ROS time is the wall's and stamps are what a laboratory's would be. A world that
is slower than that (PyBullet's tissue, on most machines) needs the simulated clock: ROS time is
then what the stand-in publishes on ``/clock``, every node follows it, and however slow the machine
is, speeds and ages are right in it.
"""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic, sleep, time
from typing import Protocol

SIMULATED_START_S = 1000.0
"""ROS time at which a simulated clock begins: 0 is no valid stamp."""


class Pace(Protocol):
    """Gives one period after the other."""

    start_s: float
    """ROS time at world time 0."""

    def now_s(self) -> float:
        """World time."""

    def ros_s(self) -> float:
        """ROS time."""

    def next_period_s(self) -> float:
        """Wait for the next period; how much world time has passed since the last one."""


class RealPace:
    """World time is wall time since the start. A late period is a longer one."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self.start_s = time()
        self._begin_s = monotonic()
        self._last_s = 0.0
        self._due_s = 0.0

    def now_s(self) -> float:
        return monotonic() - self._begin_s

    def ros_s(self) -> float:
        return self.start_s + self.now_s()

    def next_period_s(self) -> float:
        # Periods missed altogether are not made up for.
        self._due_s = max(self._due_s + self._period_s, self.now_s() - self._period_s)
        if (left_s := self._due_s - self.now_s()) > 0.0:
            sleep(left_s)
        now_s = self.now_s()
        passed_s, self._last_s = now_s - self._last_s, now_s
        return passed_s


class SimulatedPace:
    """World time goes on period by period, at most ``speed`` times as fast as the wall's."""

    def __init__(
        self, period_s: float, speed: float, publish_clock: Callable[[float], None]
    ) -> None:
        """``publish_clock`` is told ROS time once per period."""
        self._period_s = period_s
        self._wall_period_s = period_s / speed
        self._publish_clock = publish_clock
        self.start_s = SIMULATED_START_S
        self._periods = 0
        self._due_s = monotonic()

    def now_s(self) -> float:
        return self._periods * self._period_s

    def ros_s(self) -> float:
        return self.start_s + self.now_s()

    def next_period_s(self) -> float:
        self._due_s = max(self._due_s + self._wall_period_s, monotonic() - self._wall_period_s)
        if (left_s := self._due_s - monotonic()) > 0.0:
            sleep(left_s)
        self._periods += 1
        self._publish_clock(self.start_s + self.now_s())
        return self._period_s
