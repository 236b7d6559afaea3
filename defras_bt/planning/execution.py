"""What came of one rehearsed retraction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from defras_bt.planning.plan import GridPoint
from defras_sim.retraction import Rehearsal


@dataclass(frozen=True)
class Execution:
    """One rehearsed retraction, which ends where the region is exposed, as a real one does.

    ``manoeuvres`` are those begun. ``visibility`` (0..1) is the best seen. ``finished`` is False
    where the tissue model could not follow the motion to its end.
    """

    point: GridPoint
    manoeuvres: tuple[str, ...]
    visibility: float
    force_max_n: float
    finished: bool

    @classmethod
    def of(cls, rehearsal: Rehearsal) -> Self:
        return cls(
            point=rehearsal.point,
            manoeuvres=rehearsal.manoeuvres,
            visibility=rehearsal.best_visibility,
            force_max_n=rehearsal.force_max_n,
            finished=rehearsal.finished,
        )
