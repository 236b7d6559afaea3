from __future__ import annotations

import pytest

from defras_bt.recording.composite import CompositeRecorder, RecordingFailed
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from tests.recording.synthetic_run import SyntheticRun

SUMMARY = RunSummary({})


class Notes:
    """Remembers what it was told; raises at the given tick, or at the start for -1."""

    def __init__(self, breaks_at: int | None = None) -> None:
        self.breaks_at = breaks_at
        self.ticks: list[TickRecord] = []
        self.finished = 0

    def start(self, info: RunInfo) -> None:
        if self.breaks_at == -1:
            raise OSError("no room")

    def tick(self, record: TickRecord) -> None:
        if record.tick == self.breaks_at:
            raise OSError("disk full")
        self.ticks.append(record)

    def finish(self, summary: RunSummary) -> None:
        self.finished += 1


def drive(recorder: CompositeRecorder, run: SyntheticRun, count: int = 6) -> None:
    recorder.start(run.info)
    for record, _ in zip(run.ticks(), range(count), strict=False):
        recorder.tick(record)


def test_a_broken_recorder_loses_nothing_of_the_others(short_run: SyntheticRun) -> None:
    before, broken, after = Notes(), Notes(breaks_at=2), Notes()
    composite = CompositeRecorder([before, broken, after])
    drive(composite, short_run)
    with pytest.raises(RecordingFailed, match=r"Notes stopped recording at tick 2.*disk full"):
        composite.finish(SUMMARY)
    assert [len(notes.ticks) for notes in (before, broken, after)] == [6, 2, 6]
    assert [notes.finished for notes in (before, broken, after)] == [1, 1, 1]


def test_the_fault_becomes_an_event_of_the_next_tick(short_run: SyntheticRun) -> None:
    sound = Notes()
    composite = CompositeRecorder([Notes(breaks_at=-1), sound])
    drive(composite, short_run)
    told = [[e.sentence for e in record.events if e.kind == "error"] for record in sound.ticks]
    assert "no room" in told[0][0]
    assert told[1:] == [[]] * 5


def test_finish_of_all_sound_recorders_is_silent(short_run: SyntheticRun) -> None:
    composite = CompositeRecorder([Notes(), Notes()])
    drive(composite, short_run)
    composite.finish(SUMMARY)
    assert composite.faults == ()


def test_an_interrupt_passes_through(short_run: SyntheticRun) -> None:
    class Interrupted(Notes):
        def tick(self, record: TickRecord) -> None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(CompositeRecorder([Interrupted()]), short_run)
