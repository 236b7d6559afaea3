"""``defras benchmark dvrk-faults``: what becomes of a run on a dVRK when something goes wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from defras_bt.benchmark.dvrk_fault_cases import KINDS
from defras_bt.benchmark.dvrk_faults import DvrkRun, by_kind, by_run, campaign, row_of, run_of
from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import folder_for
from defras_bt.cli.kept import rows_in
from defras_bt.cli.progress import sentences
from defras_bt.dvrk.ros_packages import RosMissing, ros_module

_NOTES = (
    "Each run has a roscore, a stand-in (model world, real clock, 100 Hz) and an executive of its "
    "own, and one fault that comes when a drawn number of set-points has moved an arm. The judge "
    "reads the stand-in's record of what reached the arms, not what the executive says.",
    "When a fault could be known: what an arm says of itself or does, with its next message; "
    "messages that fail to come, when the last one is older than the set-up allows (40 ms); a "
    "wrong picture, when it leaves the camera; a repeated one, when the last true one is too old "
    "(0.5 s); a killed master, when it is killed. Counted is motion of any arm.",
    "Duplicated messages, and every second one lost, need no stop.",
)

_SHOWN = ("fault", "runs", "passed", "had to stop", "worst ms", "grip lost", "goal", "human")
"""Columns that fit on a terminal; the files have all."""


def dvrk_faults(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    times: Annotated[int, typer.Option(min=1, help="Runs of each kind.")] = 10,
    kinds: Annotated[str, typer.Option(help="Kinds of faults, separated by commas.")] = "all",
    resume: Annotated[
        bool, typer.Option(help="Go on with the runs already in the folder.")
    ] = False,
) -> None:
    """Every kind of fault many times over a real ROS master; exit code 3 if a run fails.

    A run takes about half a minute, and needs a machine with nothing else to do.

    Example: defras benchmark dvrk-faults --times 2 --kinds paused,master_killed
    """
    chosen = list(KINDS) if kinds == "all" else kinds.split(",")
    if unknown := [kind for kind in chosen if kind not in KINDS]:
        raise UserError(f"--kinds {','.join(unknown)}: valid are all, {', '.join(KINDS)}")
    try:
        ros_module("rospy")
    except RosMissing as error:
        raise UserError(str(error)) from error
    folder_for(out)
    console = sentences()
    rows = rows_in(out, "dvrk_faults", "faults on a dVRK", resume=resume)
    for run in campaign(chosen, range(times), rows.done):
        rows.add(row_of(run))
        console.print(_told(run), markup=False)
        # After every run, so that a campaign that is cut short leaves what it found.
        _write(out, [run_of(row) for row in rows.rows])
    runs = [run_of(row) for row in rows.rows]
    summary = _write(out, runs)
    shown = Table(*_SHOWN)
    for line in summary:
        shown.add_row(*(str(line[column]) for column in _SHOWN))
    Console().print(shown)
    typer.echo(f"Written to {out}: dvrk_faults.json, dvrk_faults.csv, dvrk_faults.html")
    if not all(run.passed for run in runs):
        raise typer.Exit(ExitCode.NOT_REACHED)


def _write(out: Path, runs: list[DvrkRun]) -> list[dict[str, Any]]:
    """Write the tables of ``runs``; the one by kind of fault."""
    summary = by_kind(runs)
    tables = {"By kind of fault": summary, "By run": by_run(runs)}
    write_benchmark(out, "dvrk_faults", "Faults on a dVRK", tables, _NOTES)
    return summary


def _told(run: DvrkRun) -> str:
    verdict = run.verdict
    if verdict is None:
        return f"{run.kind}, seed {run.seed}: the trial broke: {run.broke}"
    late = f", motion {verdict.late_ms:.0f} ms after it could be known" if verdict.known_s else ""
    wrong = "" if verdict.passed else f" FAILED {verdict.lost} {verdict.restarts} {verdict.broke}"
    return f"{run.kind}, seed {run.seed}: {verdict.outcome}{late}.{wrong} {verdict.reason}"
