"""Whether a jaw holds something: it was told to close and does not get there."""

from __future__ import annotations

_STEADY_RAD = 0.01
"""A jaw that turned by less since the last look has come to rest."""
_CLOSED_RAD = 0.02


class JawGrip:
    """Follows one jaw from look to look.

    A jaw that closes on nothing reaches its set-point; one that holds tissue is stopped by it and
    stays wider open. While it still turns nobody knows, and what was known before holds.
    """

    def __init__(self, closed_rad: float, holds_above_rad: float) -> None:
        self._closed_rad = closed_rad
        self._holds_above_rad = holds_above_rad
        self._last_rad: float | None = None
        self.holds = False

    def look(self, measured_rad: float, setpoint_rad: float) -> bool:
        """Whether it holds something now."""
        rests = self._last_rad is not None and abs(measured_rad - self._last_rad) < _STEADY_RAD
        self._last_rad = measured_rad
        squeezed = measured_rad - setpoint_rad >= self._holds_above_rad
        if not squeezed:
            self.holds = False
        elif rests and setpoint_rad <= self._closed_rad + _CLOSED_RAD:
            self.holds = True
        return self.holds
