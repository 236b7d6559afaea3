"""Plans, and the situation they start from, in the words of the ASP programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

GridPoint = tuple[int, int]
"""(column, row) of a grasp point, both from 1 at the smallest x and y."""

ACTIONS = ("reach", "open", "grasp", "pull", "move", "fold", "release")

MANOEUVRES = ("pull", "move", "fold")
"""Motions of held tissue, in the order in which a retraction does them."""


@dataclass(frozen=True)
class Action:
    """One atom ``action(tool, object, property, time)``, as ``reach(psm1, point, (4,2), 1)``.

    ``name`` is reach, open, grasp, pull, move, fold or release; ``point`` is the grasp point it
    concerns (the one held for pull, move, fold and release); ``time`` counts from 1.
    """

    name: str
    arm: str
    point: GridPoint | None
    time: int

    def __str__(self) -> str:
        place = "none" if self.point is None else f"({self.point[0]},{self.point[1]})"
        return f"{self.name}({self.arm},point,{place},{self.time})"


@dataclass(frozen=True)
class Plan:
    """A shortest plan with the proof that it is one.

    ``proved_shortest``: every smaller horizon was shown unsatisfiable. ``cost`` lists the values of
    the optimised priorities. ``reasons`` has one sentence per action. ``source`` is "asp" or
    "preoperative".
    """

    actions: tuple[Action, ...]
    cost: tuple[int, ...] = ()
    proved_shortest: bool = False
    reasons: tuple[str, ...] = ()
    source: str = "asp"


@dataclass(frozen=True)
class ArmSituation:
    """What an arm is doing: the grasp point it is at, the one it holds, its jaw, what it has done.

    ``done`` holds the manoeuvres finished since the grasp, in order.
    """

    at: GridPoint | None = None
    holding: GridPoint | None = None
    jaw_open: bool = False
    done: tuple[str, ...] = ()


@dataclass(frozen=True)
class Situation:
    """The sensed state a plan starts from.

    ``blocked``: grasp points that must not be used any more. ``exposing``: the manoeuvres a
    retraction must have done before the region counts as exposed (the planner is optimistic about
    the last one; the executive checks with the endoscope).
    """

    arms: Mapping[str, ArmSituation]
    blocked: frozenset[GridPoint] = field(default_factory=frozenset)
    exposing: tuple[str, ...] = ("pull", "fold")
