"""Judges a run against the stand-in by the stand-in's own record, never by what the client says.

Times are the stand-in's world time.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from defras_bt.benchmark.dvrk_fault_cases import DvrkFault

MOVED_M = 1e-6
"""A set-point that is nearer than this to the one before moves nothing."""

LATE_S = 0.05

Fact = Mapping[str, Any]


@dataclass(frozen=True)
class DvrkVerdict:
    """What a run with one fault came to.

    ``known_s``: when the fault could be known, None where it need not be. ``last_s``: the last
    set-point after it began that moved an arm, None where none did; ``late_ms``: by how much that
    was after it could be known, 0 if not.
    ``grip_lost``: tissue that was held when it came was let go. ``lost``: records that cannot be
    read, or end too early. ``restarts``: what kept a new run from starting, "" if nothing.
    """

    outcome: str
    reason: str
    begun_s: float
    known_s: float | None
    last_s: float | None
    late_ms: float
    held: bool
    grip_lost: bool
    lost: tuple[str, ...]
    restarts: str
    broke: str = ""

    @property
    def passed(self) -> bool:
        late = self.late_ms > 1e3 * LATE_S
        return bool(self.reason) and not (
            late or self.grip_lost or self.lost or self.restarts or self.broke
        )


def read_facts(witness: Path) -> list[Fact]:
    """Everything in a witness's file; a killed one's last line may be cut off, and is left out.

    Raises:
        OSError: the file cannot be read.
    """
    return [json.loads(line) for line in witness.read_text(encoding="utf-8").split("\n")[:-1]]


def moving(facts: Sequence[Fact]) -> list[float]:
    """Times of the set-points that led an arm elsewhere than the one before; not of those that the
    stand-in's own second client sent."""
    return [
        fact["time_s"]
        for fact in facts
        if fact["event"] == "goal"
        and str(fact["command"]).startswith(("servo_", "move_"))
        and "refused" not in fact
        and "by" not in fact
        and fact["way_m"] > MOVED_M
    ]


class Countdown:
    """Says when a fault is due, fact by fact of the stand-in's record."""

    def __init__(self, fault: DvrkFault) -> None:
        self._left, self._counts = fault.after, not fault.held

    def over(self, fact: Fact) -> bool:
        """Whether it is, now that ``fact`` was told too."""
        self._counts |= fact["event"] == "arm" and bool(fact["grasped"])
        if self._counts:
            self._left -= len(moving([fact]))
        return self._left <= 0


def fault_times(facts: Sequence[Fact]) -> tuple[float, float]:
    """When the fault began and ended; infinite where it did not."""
    turns = [fact for fact in facts if fact["event"] == "fault"]
    begun = [fact["time_s"] for fact in turns if fact["begins"]]
    ended = [fact["time_s"] for fact in turns if not fact["begins"]]
    return min(begun, default=float("inf")), min(ended, default=float("inf"))


def first_picture_s(pictures: Sequence[Fact], kind: str) -> float:
    """When the first picture with the fault ``kind`` left the camera; infinite without one."""
    wrong = (fact["time_s"] for fact in pictures if kind in fact["faults"])
    return min(wrong, default=float("inf"))


def first_foreign_s(facts: Sequence[Fact]) -> float:
    """When the second client's first goal came, obeyed or not; infinite without one."""
    return min((fact["time_s"] for fact in facts if "by" in fact), default=float("inf"))


def grips(facts: Sequence[Fact], from_s: float, until_s: float) -> tuple[bool, bool]:
    """Whether tissue was held at ``from_s``, and whether it was let go up to ``until_s``."""
    arms = [fact for fact in facts if fact["event"] == "arm"]
    held = {}
    for fact in arms:
        if fact["time_s"] <= from_s:
            held[fact["arm"]] = bool(fact["grasped"])
    after = [fact for fact in arms if from_s < fact["time_s"] <= until_s]
    lost = any(held.get(fact["arm"]) and not fact["grasped"] for fact in after)
    return any(held.values()), lost


def last_motion_s(times_s: Sequence[float], from_s: float) -> float | None:
    """The last of ``times_s`` from ``from_s`` on; None without any."""
    return max((time_s for time_s in times_s if time_s >= from_s), default=None)
