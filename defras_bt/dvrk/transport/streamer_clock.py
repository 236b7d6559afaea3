"""The clock of a sender that stamps its messages with the time since it was started."""

from __future__ import annotations

from math import inf


class StreamerClock:
    """Follows a clock that is seen through messages alone.

    No message comes before it was sent, and the fastest hardly later: the smallest difference
    between coming and stamp is the offset of the clocks. A delay that has been there from the very
    first message cannot be seen; one that begins later can. ``drift``: how fast the estimate
    forgets a smaller difference, because quartzes differ.
    """

    def __init__(self, drift: float = 1e-4) -> None:
        self._drift = drift
        self._offset_s, self._at_s = inf, 0.0

    def heard(self, stamp_s: float, received_s: float) -> None:
        """A message stamped ``stamp_s`` came at ``received_s`` of our own clock."""
        grown_s = self._offset_s + self._drift * (received_s - self._at_s)
        self._offset_s, self._at_s = min(grown_s, received_s - stamp_s), received_s

    def at(self, own_s: float) -> float:
        """What the sender's clock shows at ``own_s``; minus infinity before it was ever heard."""
        return own_s - self._offset_s
