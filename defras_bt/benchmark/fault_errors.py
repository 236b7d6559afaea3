"""Which exceptions of a run its faults account for; every other is a mistake in the program."""

from __future__ import annotations

from collections.abc import Iterator

from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.faults.faults import Faults
from defras_bt.recording.composite import RecordingFailed


def undeclared(error: Exception, faults: Faults) -> list[str]:
    """What ``error`` tells of that no fault of the run declares, one sentence each; [] if nothing.

    :class:`ExecutiveFailed` and :class:`RecordingFailed` only say that a run or a recorder was
    ended; what ended it stands behind them.
    """
    declared = {
        ExecutiveFailed: tuple(kind for fault in faults.faults for kind in fault.ends_runs_with),
        RecordingFailed: tuple(
            kind for fault in faults.faults for kind in fault.ends_recorders_with
        ),
    }
    return [
        f"{type(found).__name__}: {found}"
        for ended, found in _causes(error)
        if not isinstance(found, declared.get(ended, ()))
    ]


def _causes(error: BaseException) -> Iterator[tuple[type[BaseException], BaseException]]:
    """Each exception behind ``error``, and what it ended: a run, a recorder, or the program."""
    if isinstance(error, ExecutiveFailed):
        yield ExecutiveFailed, error.__cause__ or error
    elif isinstance(error, RecordingFailed):
        yield from ((RecordingFailed, found) for found in error.exceptions)
        # Recorders are finished while a failed run is on its way out.
        if error.__context__ is not None:
            yield from _causes(error.__context__)
    else:
        yield type(error), error
