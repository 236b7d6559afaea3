"""``defras plan``: rehearse before the operation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene, folder_for
from defras_bt.executive.operation import WORLDS
from defras_bt.planning.english import plan_text
from defras_bt.planning.plan_file import InvalidPlanFile, StalePlanFile, save_plan
from defras_bt.planning.preoperative import PreoperativeResult
from defras_bt.planning.preparation import Preparation, prepare
from defras_sim.scene import Scene


def plan(
    scene: Annotated[str, typer.Argument(help="Scene as believed: a file, or a shipped name.")],
    world: Annotated[str, typer.Option(help="World the plan is for: model or bullet.")] = "model",
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Plan file (JSON).")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Rehearsals side by side.")] = 2,
) -> None:
    """Rehearse every retraction in simulation and choose the plan for this patient.

    Also derives the force threshold, twice the median of the rehearsals' largest forces.

    Example: defras plan sim1 -o sim1.plan.json; defras run sim1 --plan sim1.plan.json
    """
    if world not in WORLDS:
        raise UserError(f"--world {world}: valid are {', '.join(WORLDS)}")
    _, believed = find_scene(scene)
    if out is not None:
        folder_for(out.parent)  # before minutes of rehearsals, not after
        if out.is_dir():
            raise UserError(f"--out {out} is a folder; give the name of a file")
    console = Console(soft_wrap=True, highlight=False)
    prepared = rehearsed(believed.for_bullet() if world == "bullet" else believed, console, jobs)
    if prepared.result is None:
        raise RuntimeError("preparing a plan gave no plan")
    tell(prepared.result, console)
    if out is not None:
        try:
            save_plan(prepared.result, out)
        except OSError as error:
            raise UserError(f"--out {out}: {error}") from error
        console.print(f"Written to {out}", markup=False)


def rehearsed(
    scene: Scene,
    console: Console,
    jobs: int = 2,
    *,
    with_plan: bool = True,
    plan_file: Path | None = None,
) -> Preparation:
    """Prepare with a progress bar.

    Raises:
        UserError: the plan file does not fit.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("rehearsing grasp points", total=None)
        try:
            return prepare(
                scene,
                with_plan=with_plan,
                plan_file=plan_file,
                jobs=jobs,
                progress=lambda done, total: bar.update(task, completed=done, total=total),
            )
        except (InvalidPlanFile, StalePlanFile) as error:
            raise UserError(f"--plan: {error}") from error


def tell(result: PreoperativeResult, console: Console) -> None:
    """Say what the rehearsals came to."""
    console.print(
        f"{len(result.executions)} retractions rehearsed; median of their largest forces "
        f"{result.force_median_n:.2f} N, threshold {result.force_threshold_n:.2f} N.",
        markup=False,
    )
    console.print(
        f"Chosen: {result.reason}." if result.chosen else f"None chosen: {result.reason}."
    )
    console.print(plan_text(result.plan, reasons=True), markup=False)
