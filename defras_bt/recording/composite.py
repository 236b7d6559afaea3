"""Several recorders as one, where a broken one loses nothing of the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from defras_bt.recording.record import Event, Recorder, RunInfo, RunSummary, TickRecord


@dataclass(frozen=True)
class RecordingFault:
    """What a recorder raised, and where in the run."""

    recorder: str
    moment: str
    error: Exception

    def __str__(self) -> str:
        return (
            f"{self.recorder} stopped recording at {self.moment}: "
            f"{type(self.error).__name__}: {self.error}"
        )


class RecordingFailed(ExceptionGroup[Exception]):
    """Raised by ``finish`` after every recorder has finished, with all that went wrong.

    ``summary`` is what the run came to nevertheless.
    """

    summary: RunSummary

    def __new__(
        cls, message: str, errors: Sequence[Exception], summary: RunSummary
    ) -> RecordingFailed:
        failed = super().__new__(cls, message, errors)
        failed.summary = summary
        return failed


class CompositeRecorder:
    """Fans a run out to recorders, in the order given.

    A recording must never decide how an operation goes: an exception from one recorder is kept, not
    raised, while the run lasts. The faulty recorder gets no more ticks (what it holds is cut off
    there, never has holes in the middle), its fault is told to the others as an event of kind
    ``error`` with the next tick, and ``finish`` is still called on it, so that it can close its
    file. After all have finished, ``finish`` raises :class:`RecordingFailed` with every fault: a
    run whose record is incomplete does not end in silence. ``faults`` shows them before that.

    Only ``Exception`` is treated so; KeyboardInterrupt and SystemExit pass through at once.
    """

    def __init__(self, recorders: Sequence[Recorder]) -> None:
        self._recorders = tuple(recorders)
        self._sound = list(self._recorders)
        self._untold: list[RecordingFault] = []
        self.faults: tuple[RecordingFault, ...] = ()

    def start(self, info: RunInfo) -> None:
        for recorder in tuple(self._sound):
            self._guarded(recorder, "the start", partial(recorder.start, info))

    def tick(self, record: TickRecord) -> None:
        if self._untold:
            told = tuple(
                Event(record.time_s, "error", "error", f"{fault}.") for fault in self._untold
            )
            self._untold.clear()
            record = replace(record, events=(*record.events, *told))
        for recorder in tuple(self._sound):
            self._guarded(recorder, f"tick {record.tick}", partial(recorder.tick, record))

    def finish(self, summary: RunSummary) -> None:
        for recorder in self._recorders:
            self._guarded(recorder, "the end", partial(recorder.finish, summary))
        if self.faults:
            # What fails after a recorder's first fault is mostly the same fault again.
            first = {fault.recorder: fault for fault in reversed(self.faults)}
            said = "; ".join(str(fault) for fault in reversed(first.values()))
            raise RecordingFailed(said, [fault.error for fault in self.faults], summary)

    def _guarded(self, recorder: Recorder, moment: str, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:  # noqa: BLE001  (kept, told to the others, raised by finish)
            fault = RecordingFault(type(recorder).__name__, moment, error)
            self.faults = (*self.faults, fault)
            self._untold.append(fault)
            if recorder in self._sound:
                self._sound.remove(recorder)
