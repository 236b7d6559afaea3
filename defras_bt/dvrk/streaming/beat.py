"""What the stream of set-points keeps time with."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter, sleep
from typing import Protocol

_LOOK_S = 5e-4
_STANDS_S = 0.05


class Beat(Protocol):
    """One period after the other."""

    def wait(self) -> float:
        """Wait for the next period; returns how much time passed since the last one."""


class WallBeat:
    """Periods of real time. One that began late makes the next ones no shorter."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._due_s = self._last_s = perf_counter()

    def wait(self) -> float:
        self._due_s = max(self._due_s + self._period_s, perf_counter())
        if (left_s := self._due_s - perf_counter()) > 0.0:
            sleep(left_s)
        now_s = perf_counter()
        passed_s, self._last_s = now_s - self._last_s, now_s
        return passed_s


class ClockBeat:
    """Periods of a clock that somebody else moves, as a simulation does.

    While that clock stands, a period without any time in it comes now and then: nothing moves, but
    whoever waits still looks around.
    """

    def __init__(self, period_s: float, now_s: Callable[[], float]) -> None:
        self._period_s = period_s
        self._now_s = now_s
        self._last_s = now_s()

    def wait(self) -> float:
        began_s, due_s = perf_counter(), self._last_s + self._period_s
        # A clock of whole periods may be a rounding short of the next one.
        while (now_s := self._now_s()) < due_s - 1e-6:
            if perf_counter() - began_s > _STANDS_S:
                return 0.0
            sleep(_LOOK_S)
        passed_s, self._last_s = now_s - self._last_s, now_s
        return passed_s
