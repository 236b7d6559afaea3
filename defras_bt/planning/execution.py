"""What came of one rehearsed retraction."""

from __future__ import annotations

from dataclasses import dataclass

from defras_bt.planning.plan import GridPoint


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
