"""The newest sound message of one topic, and what was wrong with those that were not."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from defras_bt.dvrk.transport.messages import Message

AnyMessage = TypeVar("AnyMessage", bound=Message)
_KEPT = 32


class Newest(Generic[AnyMessage]):
    """Takes a message only if its stamp is strictly newer than any before, and not 0.

    A message repeated by the network is dropped in silence. One that is older, from the future, or
    in another frame than ``frame`` ("" for any) is refused with a sentence in ``fault``, which
    stands until a sound message comes; so is one that ``unsound`` objects to. ``heard`` counts what
    came, ``refused`` what was wrong.
    """

    def __init__(
        self,
        what: str,
        now_s: Callable[[], float],
        frame: str = "",
        unsound: Callable[[AnyMessage], str] = lambda message: "",
    ) -> None:
        """``what`` it is in words; ``now_s`` tells the time on the clock of the stamps;
        ``unsound`` says what is wrong with a message's content, "" for nothing."""
        self._what = what
        self._unsound = unsound
        self._now_s = now_s
        self._frame = frame
        self.message: AnyMessage | None = None
        self._recent: deque[AnyMessage] = deque(maxlen=_KEPT)
        self.fault = ""
        self.heard = 0
        self.repeated = 0
        self.refused = 0

    def offer(self, message: AnyMessage) -> bool:
        """Take ``message`` if it is sound; called by the thread that hears it."""
        self.heard += 1
        fault = self._objection(message)
        if fault is None:
            self.repeated += 1
            return False
        if fault:
            self.refused += 1
            self.fault = fault
            return False
        self.message, self.fault = message, ""
        self._recent.append(message)
        return True

    def at(self, stamp_s: float) -> AnyMessage | None:
        """The sound message stamped nearest to ``stamp_s``, of the last few; None before any.

        Topics overtake each other on the way: what is compared should be of one moment.
        """
        recent = tuple(self._recent)
        return min(recent, key=lambda said: abs(said.stamp_s - stamp_s), default=None)

    def _objection(self, message: AnyMessage) -> str | None:
        """What is wrong; "" nothing, None that it is the last one once more."""
        stamp_s = message.stamp_s
        if not stamp_s > 0.0:
            return f"{self._what} comes without a time stamp: the driver marks it as not valid"
        if self._frame and message.frame != self._frame:
            return (
                f"{self._what} comes in the frame {message.frame!r}; the set-up says "
                f"{self._frame!r}"
            )
        unsound = self._unsound(message)
        if unsound:
            return f"{self._what} {unsound}"
        late_s = stamp_s - self._now_s()
        if late_s > FUTURE_S:
            return f"{self._what} is stamped {late_s:.2f} s in the future"
        if self.message is None or stamp_s > self.message.stamp_s:
            return ""
        if stamp_s == self.message.stamp_s:
            return None
        back_s = self.message.stamp_s - stamp_s
        return f"{self._what} is stamped {back_s:.3f} s before the one before it"

    def age_s(self) -> float:
        """Seconds since the newest message was stamped; infinite before the first."""
        if self.message is None:
            return float("inf")
        return max(0.0, self._now_s() - self.message.stamp_s)


FUTURE_S = 0.05
"""Clocks of two computers that are kept in step differ by less; the check measures by how much."""
