"""``defras explain``: why a run went as it did, from its record; why a plan is as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from defras_bt.cli.errors import UserError
from defras_bt.cli.explain_plan import explain_plan
from defras_bt.executive.reasons import Code, Remedy
from defras_bt.recording.decision_reader import Decisions, InvalidDecisions, read_decisions
from defras_bt.recording.explain import explain as explanation_of
from defras_bt.recording.explain import spoken
from defras_bt.recording.moment import Moment


def explain(
    run: Annotated[Path, typer.Argument(help="Folder that defras run --out left, or a plan file.")],
    tick: Annotated[int | None, typer.Option(min=0, help="Explain this tick.")] = None,
    time: Annotated[
        float | None, typer.Option(min=0, help="Explain the tick at this world time in s.")
    ] = None,
    why_not: Annotated[
        str | None, typer.Option(help='Of a plan: like "grasp psm1 point (2,3)".')
    ] = None,
    scene: Annotated[
        str | None, typer.Option(help="Of a plan: its scene, if it is not a shipped one.")
    ] = None,
) -> None:
    """Say why the run ended and when something was decided; or explain one tick.

    The chain goes from the root of the tree to the leaf that decided. Codes in brackets are stable:
    programs may compare them.

    Example: defras explain out/demo; defras explain out/demo --tick 412

    Of a plan file that defras plan wrote: why each action is there, and why not another.

    Example: defras explain sim1.plan.json --why-not "grasp psm1 point (2,3)"
    """
    console = Console(soft_wrap=True, highlight=False)
    if tick is not None and time is not None:
        raise UserError("--tick and --time: give one of them")
    if not run.exists():
        raise UserError(
            f"{run} does not exist; give a folder that defras run --out left, or a plan file that "
            "defras plan wrote"
        )
    if run.is_file():
        if tick is not None or time is not None:
            raise UserError(f"--tick and --time: {run} is a plan; they belong to a run's folder")
        explain_plan(run, scene, why_not, console)
        return
    if why_not is not None or scene is not None:
        raise UserError(f"--why-not and --scene belong to a plan file; {run} is none")
    try:
        decisions = read_decisions(run)
        if tick is None and time is None:
            _whole_run(decisions, console)
        else:
            at = _tick_at(decisions, time) if time is not None else tick
            _one_tick(decisions.at(at or 0), console)
    except InvalidDecisions as error:
        raise UserError(str(error)) from error


def _tick_at(decisions: Decisions, time_s: float) -> int:
    """The last tick that was not later than ``time_s``."""
    before = [line["tick"] for line in decisions.lines if line["time_s"] <= time_s]
    return int(before[-1]) if before else 0


def _one_tick(moment: Moment, console: Console) -> None:
    console.print(explanation_of(moment).text, markup=False)
    for event in moment.events:
        console.print(f"Told at this tick: {event.sentence}", markup=False)
    for cause in dict.fromkeys((moment.ended, moment.stopped_by, moment.cause)):
        if cause is not None:
            _look_up(cause.code, console)


def _look_up(word: str, console: Console) -> None:
    """What a code means and what helps against it."""
    code = next((code for code in Code if code.value == word), None)
    if code is None:
        return
    remedies = [remedy.spoken for remedy in Remedy if remedy in code.remedies]
    helps = f" What may help: {', '.join(remedies)}." if remedies else ""
    console.print(f"[{word}] means: {code.meaning}.{helps}", markup=False, style="dim")


def _whole_run(decisions: Decisions, console: Console) -> None:
    last = decisions.last()
    if last.ended is None:
        console.print("The record ends while the operation goes on; its last tick:", markup=False)
    console.print(explanation_of(last).text, markup=False)
    table = Table(title="Ticks at which something was decided", title_justify="left", box=None)
    for column in ("tick", "time [s]", "decided by", "because"):
        table.add_column(column, justify="right" if column in ("tick", "time [s]") else "left")
    for moment in decisions.turning_points():
        if moment.cause is not None:
            leaf = spoken(moment.cause.path.rpartition("/")[2])
            said = moment.cause.message
            if moment.stopped_by is not None and moment.stopped_by.path != moment.cause.path:
                said = f"{said} (no plan was carried out: {moment.stopped_by.message})"
            table.add_row(str(moment.tick), f"{moment.time_s:.2f}", leaf, said)
    console.print(table, markup=False)
