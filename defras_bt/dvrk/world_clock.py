"""World time of a robot, which no program moves.

This is the one place where the executive's time comes from a clock: stamps of the robot's messages
count from the moment that the world began, and between two looks at the robot's clock this
computer's runs on. Everything above works with world time alone.
"""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic, sleep

_LOOK_S = 0.002


class WorldClock:
    """Seconds since ``begin_s`` of the robot's clock."""

    def __init__(self, begin_s: float, tick_s: float, *, simulated: bool) -> None:
        """``simulated``: the robot's clock is a simulation's; only looking at it tells the time."""
        self.begin_s = begin_s
        self._tick_s = tick_s
        self._simulated = simulated
        self._looked_s, self._seen_s = monotonic(), begin_s
        self._due_s = self._looked_s
        self._due_world_s = 0.0

    def world_s(self, stamp_s: float) -> float:
        """World time of a stamp."""
        return stamp_s - self.begin_s

    def looked(self, clock_s: float) -> None:
        """The robot's clock shows ``clock_s`` now."""
        self._looked_s, self._seen_s = monotonic(), clock_s

    def now_s(self) -> float:
        """World time now."""
        passed_s = 0.0 if self._simulated else monotonic() - self._looked_s
        return self._seen_s - self.begin_s + passed_s

    def wait_for_tick(self, look: Callable[[], float]) -> None:
        """Wait until the next tick is due. ``look`` tells the robot's clock; it is only asked
        where that is a simulation's, and for no longer than ten ticks where it stands."""
        if not self._simulated:
            self._due_s = max(self._due_s + self._tick_s, monotonic())
            sleep(max(0.0, self._due_s - monotonic()))
            return
        began_s = monotonic()
        self._due_world_s += self._tick_s
        while (now_s := look() - self.begin_s) < self._due_world_s - 1e-6:
            if monotonic() - began_s > 10.0 * self._tick_s:
                break
            sleep(_LOOK_S)
        self._due_world_s = max(self._due_world_s, now_s)
