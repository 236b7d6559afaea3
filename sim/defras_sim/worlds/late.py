"""Readings that arrive late, with a stamp that does not tell."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

Reading = TypeVar("Reading")

# Of a second: sums of ticks may miss a time by rounding.
_ROUNDING_S = 1e-9


class LateReadings(Generic[Reading]):
    """Holds each reading back for ``delay_s``; it is stamped when it comes out.

    The first one comes out at once: before it, everything was at rest.
    """

    def __init__(self, delay_s: float, stamped: Callable[[Reading, float], Reading]) -> None:
        """``stamped`` gives a reading another stamp [s]."""
        self._delay_s = delay_s
        self._stamped = stamped
        self._waiting: deque[tuple[float, Reading]] = deque()
        self._started = False

    def add(self, time_s: float, reading: Reading) -> None:
        """A reading taken at ``time_s``, stamped so."""
        self._waiting.append((time_s + self._delay_s if self._started else time_s, reading))
        self._started = True

    def arrived(self, time_s: float) -> Reading | None:
        """The newest reading that is out at ``time_s`` and was not before."""
        newest: Reading | None = None
        while self._waiting and self._waiting[0][0] <= time_s + _ROUNDING_S:
            out_s, reading = self._waiting.popleft()
            newest = reading if self._delay_s == 0.0 else self._stamped(reading, out_s)
        return newest
