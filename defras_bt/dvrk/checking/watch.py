"""Listens to an arm for a while and keeps when each message was stamped and when it came."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence

import numpy as np

from defras_bt.dvrk.transport.messages import Message, PoseMessage
from defras_bt.dvrk.transport.transport import Transport
from defras_sim.geometry import Floats

WATCHED = ("measured_cp", "setpoint_cp", "measured_js", "jaw/measured_js")
"""Topics that have to come at the rate of the driver."""


class Watch:
    """Stamps and arrivals of the watched topics of one arm, on the robot's clock."""

    def __init__(self, arm: str, transport: Transport, topics: Sequence[str] = WATCHED) -> None:
        self._now_s = transport.now_s
        self._times_s: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
        self._places_m: list[Floats] = []
        for topic in topics:
            transport.listen(arm, topic, self._noting(topic))

    def stamps_s(self, topic: str) -> Floats:
        """Strictly rising stamps of a topic (n,); what was repeated or stamped 0 is left out."""
        stamps = [stamp for stamp, _ in self._times_s[topic] if stamp > 0.0]
        return np.unique(np.array(stamps, float))

    def delays_s(self, topic: str) -> Floats:
        """From each message's stamp to its coming (n,)."""
        return np.array([came - stamp for stamp, came in self._times_s[topic] if stamp > 0.0])

    def rate_hz(self, topic: str) -> float:
        """Messages per second between the first stamp and the last; 0 where there are too few."""
        stamps = self.stamps_s(topic)
        if len(stamps) < 3:
            return 0.0
        return float((len(stamps) - 1) / (stamps[-1] - stamps[0]))

    @property
    def moved_m(self) -> float:
        """How far the set-point went while it was watched."""
        if not self._places_m:
            return 0.0
        places = np.array(self._places_m)
        return float(np.linalg.norm(places - places[0], axis=1).max())

    def _noting(self, topic: str) -> Callable[[Message], None]:
        def note(message: Message) -> None:
            self._times_s[topic].append((message.stamp_s, self._now_s()))
            if topic == "setpoint_cp" and isinstance(message, PoseMessage):
                self._places_m.append(message.pose.position_m)

        return note
