"""What the arm says it was told, beside what it was told here."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import dist

import numpy as np

from defras_sim.geometry import Floats, Pose

_MEMORY_S = 0.3
"""A command that an arm has not taken up after so long was lost."""
_MOVED_M = 3e-4
_SAME_M = 2e-5
"""An arm goes to a set-point by its own joints, which rounds it a little."""


@dataclass(frozen=True)
class SentPoint:
    """A set-point: when it left, on the robot's clock, and frame_from_reported: its origin (3,)
    and rotation (3, 3)."""

    sent_s: float
    position_m: Floats
    rotation: Floats


class Echo:
    """Compares the set-points that come back with those that went out in the last 0.3 s.

    ``applied`` is called with each set-point's time of leaving and the stamp of the echo that
    first shows it, where it can be told from the one before it.
    """

    def __init__(
        self,
        tolerance_m: float,
        tolerance_rad: float,
        applied: Callable[[float, float], None],
    ) -> None:
        self._tolerance_m = tolerance_m
        self._tolerance_rad = tolerance_rad
        self._applied = applied
        self._sent: deque[SentPoint] = deque()
        self._awaited: deque[SentPoint] = deque(maxlen=200)
        self._echoed: deque[tuple[float, Floats]] = deque()
        self.fault = ""
        """Why the echo cannot be of what was sent here; "" where it can."""

    def restart(self) -> None:
        """Nothing is being sent any more: forget what was."""
        self._sent.clear()
        self._awaited.clear()
        self.fault = ""

    def sent(self, now_s: float, pose: Pose) -> None:
        """``pose`` (frame_from_reported) has just left."""
        point = SentPoint(now_s, pose.position_m, pose.rotation)
        if self._sent and dist(self._sent[-1].position_m, point.position_m) > _SAME_M:
            self._awaited.append(point)
        self._sent.append(point)
        while len(self._sent) > 2 and self._sent[1].sent_s < now_s - _MEMORY_S:
            self._sent.popleft()

    def heard(self, stamp_s: float, pose: Pose) -> None:
        """The arm said, at ``stamp_s``, that its set-point is ``pose`` (frame_from_reported)."""
        if self._echoed and stamp_s <= self._echoed[-1][0]:
            return
        here_m = pose.position_m
        self._echoed.append((stamp_s, here_m))
        while self._echoed[0][0] < stamp_s - _MEMORY_S:
            self._echoed.popleft()
        while self._awaited and self._reached(here_m):
            self._applied(self._awaited.popleft().sent_s, stamp_s)
        self.fault = self._judge(pose)

    @property
    def moved_m(self) -> float:
        """How far the echoed set-point went in the last 0.3 s."""
        if not self._echoed:
            return 0.0
        return max(dist(self._echoed[-1][1], place) for _, place in self._echoed)

    def _reached(self, here_m: Floats) -> bool:
        """Whether the set-point awaited first, or one after it, is where the echo is."""
        return any(dist(point.position_m, here_m) <= _SAME_M for point in self._awaited)

    def _judge(self, here: Pose) -> str:
        if not self._sent:
            return ""
        off_m = _distance_m(np.array([p.position_m for p in self._sent]), here.position_m)
        off_rad = _angle_rad(np.array([p.rotation for p in self._sent]), here.rotation)
        if off_m <= self._tolerance_m and off_rad <= self._tolerance_rad:
            return ""
        if off_m > self._tolerance_m and self.moved_m <= _MOVED_M:
            return (
                f"does not take up what it is sent: its set-point stays {off_m * 1e3:.1f} mm behind"
            )
        return (
            f"is commanded by somebody else as well: its set-point went {off_m * 1e3:.1f} mm and "
            f"{np.degrees(off_rad):.1f} degrees away from all that was sent here"
        )


def _distance_m(path_m: Floats, point_m: Floats) -> float:
    """From a point (3,) to a path of straight pieces between points (n, 3)."""
    if len(path_m) == 1:
        return dist(path_m[0], point_m)
    start, way = path_m[:-1], np.diff(path_m, axis=0)
    squared = np.maximum(np.sum(way**2, axis=1), 1e-18)
    share = np.clip(np.sum((point_m - start) * way, axis=1) / squared, 0.0, 1.0)
    nearest = start + share[:, None] * way
    return float(np.sqrt(np.min(np.sum((nearest - point_m) ** 2, axis=1))))


def _angle_rad(rotations: Floats, rotation: Floats) -> float:
    """The smallest angle between a rotation (3, 3) and one of several (n, 3, 3)."""
    traces = np.einsum("nij,ij->n", rotations, rotation)
    return float(np.arccos(np.clip((traces.max() - 1.0) / 2.0, -1.0, 1.0)))
