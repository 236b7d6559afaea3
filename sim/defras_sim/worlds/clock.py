"""World time, counted in ticks so that it never drifts, and what is due at which tick."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

# Of a period: sums of ticks may miss a multiple of it by rounding.
_ROUNDING = 1e-6


@dataclass
class TickClock:
    """World time of a simulated world that is stepped by ``tick_s``."""

    tick_s: float
    ticks: int = 0

    @property
    def time_s(self) -> float:
        return self.ticks * self.tick_s

    def tick(self) -> None:
        """Let a tick pass."""
        self.ticks += 1

    def due(self, period_s: float) -> bool:
        """Whether a multiple of ``period_s`` lies in the tick that just passed; True at the start.

        >>> clock = TickClock(0.05)
        >>> [clock.due(0.1), clock.tick(), clock.due(0.1), clock.tick(), clock.due(0.1)]
        [True, None, False, None, True]
        """
        return self.ticks == 0 or self._periods(self.ticks, period_s) > self._periods(
            self.ticks - 1, period_s
        )

    def _periods(self, ticks: int, period_s: float) -> int:
        """Whole periods that have passed after so many ticks."""
        return floor(ticks * self.tick_s / period_s + _ROUNDING)
