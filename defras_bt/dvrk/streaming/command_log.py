"""Every set-point with the time it was sent and the time the arm showed that it took it."""

from __future__ import annotations

import csv
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from defras_bt.dvrk.streaming.periods import Durations
from defras_sim.geometry import Floats, Pose

COLUMNS = (
    *("arm", "sent_s", "applied_s", "x_m", "y_m", "z_m"),
    *("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w"),
)
_WAIT_S = 1.0
"""So long a line waits for the time at which its set-point was applied."""


@dataclass
class _Line:
    arm: str
    sent_s: float
    position_m: Floats
    quaternion_xyzw: Floats
    applied_s: float | None = None


class CommandLog:
    """Keeps lines until they are complete, and writes them to ``file`` when :meth:`write` is
    called, outside the stream's own thread. Times are of the robot's clock. What ``file`` held is
    replaced with the first line.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._lines: deque[_Line] = deque()
        self._open: dict[tuple[str, float], _Line] = {}
        self._lock = Lock()
        self.took_up = Durations()
        """From sending to the echo, where it could be told."""
        self._begun = False

    def sent(self, arm: str, sent_s: float, pose: Pose) -> None:
        line = _Line(arm, sent_s, pose.position_m, pose.quaternion_xyzw)
        with self._lock:
            self._lines.append(line)
            self._open[arm, sent_s] = line

    def applied(self, arm: str, sent_s: float, applied_s: float) -> None:
        """The set-point that left at ``sent_s`` was in force at ``applied_s``."""
        self.took_up.add(applied_s - sent_s)
        with self._lock:
            line = self._open.pop((arm, sent_s), None)
            if line is not None:
                line.applied_s = applied_s

    def write(self, now_s: float = float("inf")) -> None:
        """Append what is complete, or too old to become so, to the file.

        Raises:
            OSError: it cannot be written.
        """
        ready = []
        with self._lock:
            while self._lines and self._lines[0].sent_s < now_s - _WAIT_S:
                line = self._lines.popleft()
                self._open.pop((line.arm, line.sent_s), None)
                ready.append(line)
        if self._file is None or not ready:
            return
        with self._file.open("a" if self._begun else "w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            if not self._begun:
                writer.writerow(COLUMNS)
            writer.writerows(_row(line) for line in ready)
        self._begun = True


def _row(line: _Line) -> list[str]:
    applied = "" if line.applied_s is None else f"{line.applied_s:.6f}"
    numbers = [*line.position_m.tolist(), *line.quaternion_xyzw.tolist()]
    return [line.arm, f"{line.sent_s:.6f}", applied, *(f"{number:.7f}" for number in numbers)]
