from __future__ import annotations

from dataclasses import replace
from io import StringIO

import pytest
from rich.console import Console

from defras_bt.recording.progress import EventPrinter, ProgressLine, progress_line
from defras_bt.recording.record import Recorder
from defras_bt.recording.summary import SummaryRecorder
from tests.recording.synthetic_run import SyntheticRun


def said(run: SyntheticRun, terminal: bool, *kinds: type[EventPrinter | ProgressLine]) -> str:
    out = StringIO()
    console = Console(file=out, force_terminal=terminal, width=160, color_system=None)
    numbers = SummaryRecorder()
    recorders: list[Recorder] = [numbers, *(kind(console) for kind in kinds)]
    for recorder in recorders:
        recorder.start(run.info)
    for record in run.ticks():
        for recorder in recorders:
            recorder.tick(record)
    for recorder in recorders:
        recorder.finish(numbers.summary("goal", wall_s=1.0))
    return out.getvalue()


def row(run: SyntheticRun, tick: int, **changes: object) -> str:
    console = Console(file=StringIO(), width=200, color_system=None)
    with console.capture() as captured:
        console.print(progress_line(replace(run.ticks()[tick], **changes), run.info))
    return " ".join(captured.get().split())


def test_events_are_told_line_by_line(short_run: SyntheticRun) -> None:
    lines = said(short_run, False, EventPrinter, ProgressLine).splitlines()
    events = [event for record in short_run.ticks() for event in record.events]
    assert len(lines) == len(events) + 1
    assert lines[0].strip() == "0.00 s  The operation starts with a pre-operative plan."
    assert lines[-1] == "Goal reached: 94 % of the region is visible after 9 actions."


def test_without_a_terminal_the_line_is_quiet(short_run: SyntheticRun) -> None:
    assert said(short_run, False, ProgressLine) == ""


def test_with_a_terminal_the_line_lives(short_run: SyntheticRun) -> None:
    assert "PSM2 folds the tissue away" in said(short_run, True, EventPrinter, ProgressLine)


def test_the_row(short_run: SyntheticRun) -> None:
    assert row(short_run, 106) == (
        "5.3 s 4/5 PSM1 pulls the tissue up, held at (1,4) F 0.25/0.30 N "
        "mu 3.8 mm s=1 rate 50 % region 0 %"
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"force_n": float("nan")}, "F ?/0.30 N"),
        ({"plan": None}, "no action"),
        ({"reading": None}, "0.30 N rate"),
        ({"plan_step": None}, "no action"),
    ],
)
def test_what_is_unknown(short_run: SyntheticRun, changes: dict[str, object], words: str) -> None:
    assert words in row(short_run, 106, **changes)


def test_a_narrow_terminal_gets_one_line(short_run: SyntheticRun) -> None:
    console = Console(file=StringIO(), width=50, color_system=None)
    with console.capture() as captured:
        console.print(progress_line(short_run.ticks()[106], short_run.info))
    assert captured.get().count("\n") == 1
