"""How messages get from the stand-in to those who listen: late, twice, wrongly stamped, or not."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.faults import Delayed, Duplicated, Lost, Source, Stamps
from defras_bt.dvrk.stand_in.menu import Menu


class Publisher(Protocol):
    """What of a rospy.Publisher is needed."""

    def publish(self, message: Any, /) -> None: ...


class Delivery:
    """Hands messages to their publishers, as the faults of a menu have it.

    Not for several threads at once. Times are world time; ``start_s`` is the ROS time of its 0.
    """

    def __init__(
        self,
        menu: Menu,
        rng: np.random.Generator,
        start_s: float,
        usual_delay_s: Mapping[Source, float] | None = None,
    ) -> None:
        """``usual_delay_s``: how long messages of a source always take."""
        self._menu, self._rng, self._start_s = menu, rng, start_s
        self._usual_delay_s = dict(usual_delay_s or {})
        self._time = ros_module("genpy").Time
        self._waiting: deque[tuple[float, Publisher, Any]] = deque()

    def deliver(self, source: Source, out: Publisher, message: Any, now_s: float) -> None:
        """Send ``message``, which ``source`` made at ``now_s``, now or later."""
        for lost in self._menu.there(Lost):
            if lost.what == source and self._rng.random() < lost.probability:
                return
        for stamps in self._menu.there(Stamps):
            if stamps.what == source:
                message.header.stamp = self._time.from_sec(self._start_s + _told(stamps, now_s))
        delay_s = self._usual_delay_s.get(source, 0.0)
        delay_s += sum(d.delay_s for d in self._menu.there(Delayed) if d.what == source)
        times = 1 + any(d.what == source for d in self._menu.there(Duplicated))
        for _ in range(times):
            if delay_s > 0.0:
                self._waiting.append((now_s + delay_s, out, message))
            else:
                out.publish(message)

    def flush(self, now_s: float) -> None:
        """Send what was held back and is due; call it every period."""
        still: deque[tuple[float, Publisher, Any]] = deque()
        for due_s, out, message in self._waiting:
            if due_s <= now_s + 1e-9:
                out.publish(message)
            else:
                still.append((due_s, out, message))
        self._waiting = still


def _told(stamps: Stamps, now_s: float) -> float:
    """World time that a wrong stamp says."""
    if stamps.fault == "stale_stamps":
        return stamps.start_s
    return stamps.start_s - (now_s - stamps.start_s)
