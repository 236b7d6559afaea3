"""Tells in the log why motion stopped and why a run ended, in the words of ``defras explain``."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from defras_bt.executive.reasons import Code
from defras_bt.recording.explain import explain
from defras_bt.recording.moment import moment_of
from defras_bt.recording.record import Event, Level, TickRecord


class WhyTeller:
    """One event ``why`` when a plan is broken off, and one when a run ends short of its goal."""

    def __init__(self) -> None:
        self._was_under_way = False

    def event(
        self, record: TickRecord, kinds: Callable[[], Iterable[tuple[str, str]]]
    ) -> Event | None:
        """The event of this tick, if it is one of those; ask every tick.

        ``kinds()`` gives path and kind of every node now in the tree.
        """
        ended = record.ended
        under_way = record.plan_step is not None
        finished = record.stopped_by is None or record.stopped_by.code == Code.PLAN_FINISHED
        broken_off = self._was_under_way and not under_way and not finished
        ended_short = ended is not None and ended.code != Code.GOAL
        self._was_under_way = under_way
        if not broken_off and not ended_short:
            return None
        why = explain(moment_of(record, dict(kinds())))
        level: Level = "error" if ended_short else "warning"
        return Event(record.time_s, "why", level, why.summary, {"chain": list(why.chain)})
