"""``defras plan``: rehearse before the operation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from pydantic import ValidationError
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene, folder_for
from defras_bt.cli.progress import counting
from defras_bt.executive.operation import WORLDS
from defras_bt.planning.advice_file import add_advice, rule_name
from defras_bt.planning.engine import (
    VALID,
    Engine,
    EngineUnavailable,
    UnknownEngine,
    engine_named,
)
from defras_bt.planning.english import plan_text
from defras_bt.planning.journal import InvalidJournal, Journal
from defras_bt.planning.plan_file import (
    InvalidPlanFile,
    StalePlanFile,
    UnusableThreshold,
    save_plan,
)
from defras_bt.planning.preoperative import PreoperativeResult, preoperative_plans
from defras_bt.planning.preparation import Preparation, prepare
from defras_bt.planning.rehearsals import Progress as Report
from defras_sim.advice import Advice
from defras_sim.scene import Scene


def plan(
    scenes: Annotated[list[str], typer.Argument(help="Scenes as believed: files, shipped names.")],
    world: Annotated[str, typer.Option(help="World the plan is for: model or bullet.")] = "model",
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Plan file (JSON); with several scenes, a folder."),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=-1, help="Rehearsals side by side; -1: one per core.")
    ] = -1,
    engine: Annotated[str, typer.Option(help=f"Where to rehearse: {VALID}.")] = "local",
    robust: Annotated[
        int, typer.Option(min=0, help="Sets of attachments sampled around the belief.")
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Of the sampled sets.")] = 0,
    forbid: Annotated[
        str | None, typer.Option(help='Add a rule first, like "grasp psm1 point (2,3)".')
    ] = None,
    prefer: Annotated[
        str | None, typer.Option(help="Add a preference first; it makes no plan longer.")
    ] = None,
    reason: Annotated[str | None, typer.Option(help="Why; kept with the rule.")] = None,
    name: Annotated[str | None, typer.Option(help="The rule's name.")] = None,
) -> None:
    """Rehearse every retraction in simulation and choose the plan for this patient.

    Also derives the force threshold, twice the median of the largest forces of all rehearsals of
    all scenes given. With --out a search that was killed goes on where it was. A rule given with
    --forbid or --prefer is kept in the scene file, with its name and reason, for all later plans.
    With --robust the retraction is chosen that works in most sets of attachments around the belief.

    Example: defras plan sim1 -o sim1.plan.json; defras run sim1 --plan sim1.plan.json

    Example: defras plan sim1 sim2 sim3 --out plans --engine dask

    Example: defras plan my.yaml --forbid "grasp psm1 point (2,3)" --reason "a vein runs there"
    """
    if world not in WORLDS:
        raise UserError(f"--world {world}: valid are {', '.join(WORLDS)}")
    if jobs == 0:
        raise UserError("--jobs 0: give a number of processes, or -1 for one per core")
    found = [find_scene(scene) for scene in scenes]
    believed = [scene for _, scene in found]
    if forbid or prefer or reason or name:
        believed = [_advised(found[0][0], scenes, forbid, prefer, reason, name)]
    try:
        where = engine_named(engine, jobs)
    except UnknownEngine as error:
        raise UserError(f"--{error}") from error
    files = _plan_files(believed, out)  # before minutes of rehearsals, not after
    console = Console(soft_wrap=True, highlight=False)
    journal = None
    try:
        if files:
            journal = Journal(files[0].with_name("rehearsals.journal"))
        with _progress(console) as report:
            results = preoperative_plans(
                [scene.for_bullet() if world == "bullet" else scene for scene in believed],
                engine=where,
                journal=journal,
                progress=report,
                samples=robust,
                rng=np.random.default_rng(seed),
            )
    except (EngineUnavailable, InvalidJournal) as error:
        raise UserError(str(error)) from error
    for i, (scene, result) in enumerate(zip(believed, results, strict=True)):
        if len(results) > 1:
            console.print(f"Scene {result.scene}:", markup=False)
        for rule in scene.advice:
            console.print(f"Kept in the scene: {rule.sentence()}.", markup=False)
        tell(result, console)
        if files:
            try:
                save_plan(result, files[i])
            except (OSError, UnusableThreshold) as error:
                raise UserError(f"--out {out}: {error}") from error
            console.print(f"Written to {files[i]}", markup=False)
    if journal is not None:
        journal.file.unlink(missing_ok=True)


def _advised(
    file: Path,
    scenes: list[str],
    forbid: str | None,
    prefer: str | None,
    reason: str | None,
    name: str | None,
) -> Scene:
    """Add the rule to the scene file; the scene as it is then."""
    if len(scenes) > 1:
        raise UserError(f"a rule belongs to one scene; {len(scenes)} were given")
    if not Path(scenes[0]).is_file():
        raise UserError(
            f"a rule is kept in the scene's file, and {scenes[0]} is a shipped scene; copy {file} "
            "and give the copy"
        )
    if (forbid is None) == (prefer is None):
        raise UserError("--name and --reason belong to --forbid or --prefer; give one of them")
    if not reason:
        raise UserError('--reason is missing: say why, like --reason "a vein runs there"')
    kind, text = ("forbid", forbid) if forbid is not None else ("prefer", prefer)
    rule = {"name": name or rule_name(kind, text or ""), "reason": reason, kind: text}
    try:
        return add_advice(file, Advice.model_validate(rule))
    except ValidationError as error:
        raise UserError(f"--{kind}: {error.errors()[0]['msg']}") from error
    except OSError as error:
        raise UserError(f"{file}: {error}") from error


def _plan_files(scenes: list[Scene], out: Path | None) -> list[Path]:
    """Where each scene's plan goes; none without ``out``. The folder exists afterwards."""
    if out is None:
        return []
    if len(scenes) == 1:
        folder_for(out.parent)
        if out.is_dir():
            raise UserError(f"--out {out} is a folder; give the name of a file")
        return [out]
    names = [scene.name for scene in scenes]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise UserError(f"several scenes are named {', '.join(twice)}; plan them one by one")
    folder_for(out)
    return [out / f"{name}.plan.json" for name in names]


def rehearsed(
    scene: Scene,
    console: Console,
    jobs: int = -1,
    *,
    with_plan: bool = True,
    plan_file: Path | None = None,
) -> Preparation:
    """Prepare with a progress bar.

    Raises:
        UserError: the plan file does not fit.
    """
    with _progress(console) as report:
        try:
            return prepare(
                scene,
                with_plan=with_plan,
                plan_file=plan_file,
                engine=Engine(jobs=jobs),
                progress=report,
            )
        except (InvalidPlanFile, StalePlanFile) as error:
            raise UserError(f"--plan: {error}") from error


@contextmanager
def _progress(console: Console) -> Iterator[Report]:
    """A bar with the time left; off a terminal a line at every fifth of the way."""
    with counting(console, transient=True) as bar:
        task = bar.add_task("rehearsing grasp points", total=None)

        def report(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)
            if done and not console.is_terminal and (5 * done) // total > (5 * (done - 1)) // total:
                console.print(f"rehearsing grasp points: {done} of {total}", markup=False)

        yield report


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
