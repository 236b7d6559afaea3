"""``defras benchmark table1`` and ``table2``: whole retractions, every tree on every patient."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, get_args

import typer
from rich.console import Console
from rich.table import Table

from defras_bt.benchmark.cases import Case, generated_cases, table1_cases, table2_cases
from defras_bt.benchmark.dvrk_retraction import DvrkSetting, dvrk_rows
from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.preparations import prepared
from defras_bt.benchmark.retraction import ALL_RUNS, RUNS, TREES, Row, run_cases
from defras_bt.benchmark.retraction_summary import by_case, spread, success
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for
from defras_bt.cli.kept import rehearsals_in, rows_in
from defras_bt.cli.progress import counting, sentences
from defras_bt.dvrk.ros_packages import RosMissing, ros_module
from defras_bt.dvrk.stand_in.order import WorldName
from defras_bt.executive.operation import ROBOT_WORLD, WORLDS

FIRST_UNSEEN_SEED = 10_000
"""Generated scenes of lower seeds were looked at while the trees were made."""

USUAL_RUNS = ",".join(RUNS)

Out = Annotated[Path, typer.Option(help="Folder for the results.")]
World = Annotated[str, typer.Option(help="model or bullet.")]
Runs = Annotated[str, typer.Option(help=f"Separated by commas: {', '.join(ALL_RUNS)}.")]
Seed = Annotated[int, typer.Option(min=0, help="Of the worlds' noise.")]
Jobs = Annotated[int, typer.Option(min=1, help="Runs side by side.")]
Resume = Annotated[bool, typer.Option(help="Go on with the rows already in the folder.")]


def table1(
    out: Out = Path("out/benchmark"),
    world: World = "model",
    trees: Runs = USUAL_RUNS,
    seed: Seed = 0,
    seeds: Annotated[
        int, typer.Option(min=0, help="Instead: this many generated patients of each kind.")
    ] = 0,
    first_seed: Annotated[int, typer.Option(min=0, help="Of the generated patients.")] = (
        FIRST_UNSEEN_SEED
    ),
    jobs: Jobs = 2,
    resume: Resume = False,
) -> None:
    """Fewer and more attachments than believed: the paper's 16 cases, or generated patients.

    Example: defras benchmark table1 --world model --out out/benchmark

    Example: defras benchmark table1 --seeds 100 --trees defras,oracle --out out/seeds
    """
    cases = generated_cases(first_seed, seeds) if seeds else table1_cases()
    title = f"Fewer and more attachments than believed ({world} world)"
    _measure("table1", title, cases, out, world, trees, seed, jobs, resume)


def table2(
    out: Out = Path("out/benchmark"),
    world: Annotated[str, typer.Option(help="model, bullet or dvrk (over ROS).")] = "model",
    trees: Annotated[
        str | None, typer.Option(help=f"Separated by commas: {', '.join(ALL_RUNS)}.")
    ] = None,
    seed: Seed = 0,
    jobs: Jobs = 2,
    resume: Resume = False,
    patient: Annotated[
        str, typer.Option(help="World behind the dVRK's stand-in: bullet or model.")
    ] = "bullet",
    imperfections: Annotated[
        str, typer.Option(help="Of the stand-in's arms and cameras: lab, none, or a file.")
    ] = "lab",
) -> None:
    """The set-ups A, B and C with fewer, more and as many attachments believed.

    With --world dvrk each run has a roscore and a stand-in of its own, with the imperfections of
    real arms; the belief knows what the arms' joints do, as a laboratory does that has calibrated
    them, and nothing of the errors of registration.

    Example: defras benchmark table2 --world model --out out/benchmark
    """
    if world == ROBOT_WORLD:
        setting = _setting(patient, imperfections)
        _measure_dvrk(out, setting, trees or TREES[0], seed, jobs, resume)
        return
    title = f"Fewer, more and as many attachments believed ({world} world)"
    runs = trees or USUAL_RUNS
    _measure("table2", title, table2_cases(), out, world, runs, seed, jobs, resume)


def _setting(patient: str, imperfections: str) -> DvrkSetting:
    if patient not in get_args(WorldName):
        raise UserError(f"--patient {patient}: valid are {', '.join(get_args(WorldName))}")
    if imperfections not in ("lab", "none") and not Path(imperfections).is_file():
        raise UserError(f"--imperfections {imperfections}: valid are lab, none, or a file")
    return DvrkSetting("bullet" if patient == "bullet" else "model", imperfections)


def _measure_dvrk(
    out: Path, setting: DvrkSetting, trees: str, seed: int, jobs: int, resume: bool
) -> None:
    runs = trees.split(",")
    if unknown := [run for run in runs if run not in TREES]:
        raise UserError(f"--trees {','.join(unknown)}: with --world dvrk {', '.join(TREES)}")
    try:
        ros_module("rospy")
    except RosMissing as error:
        raise UserError(str(error)) from error
    folder_for(out)
    console = sentences()
    name, told = "table2_dvrk", f"{setting.patient} patient, imperfections {setting.imperfections}"
    rows = rows_in(out, name, f"{name}, {told}, seed {seed}", resume=resume)
    journal = rehearsals_in(out)
    console.print("Rehearsing the 17 configurations for the force threshold", markup=False)
    preparations = prepared(setting.patient, jobs=jobs, journal=journal)
    cases = table2_cases()
    for row in dvrk_rows(cases, runs, setting, preparations, seed=seed, done=rows.done):
        rows.add(row)
        console.print(_told(row), markup=False)
    notes = [
        f"World: dvrk, over a ROS 1 master, {told}. Seed: {seed}. Simulated clock. Force "
        f"threshold: {2 * preparations.force_median_n:.3f} N.",
        "F max true is that of the stand-in's patient, which the executive never sees.",
    ]
    title = f"Fewer, more and as many attachments believed (dVRK's stand-in, {told})"
    wanted = {f"{case.name} {case.relation} {run}" for case in cases for run in runs}
    _write(out, name, title, [row for row in rows.rows if row.key in wanted], notes)
    rows.discard()


def _measure(
    name: str,
    title: str,
    cases: Sequence[Case],
    out: Path,
    world: str,
    trees: str,
    seed: int,
    jobs: int,
    resume: bool,
) -> None:
    if world not in WORLDS:
        raise UserError(f"--world {world}: valid are {', '.join(WORLDS)}")
    runs = trees.split(",")
    if unknown := [run for run in runs if run not in ALL_RUNS]:
        raise UserError(f"--trees {','.join(unknown)}: valid are {', '.join(ALL_RUNS)}")
    folder_for(out)  # before the runs, not after
    console = sentences()
    question = f"{name}, {world} world, seed {seed}"
    rows = rows_in(out, name, question, resume=resume)
    journal = rehearsals_in(out)
    wanted = {f"{case.name} {case.relation} {run}" for case in cases for run in runs}
    with counting(console) as bar:
        task = bar.add_task("rehearsing the 17 configurations", total=None)
        preparations = prepared(
            world,
            jobs=jobs,
            journal=journal,
            progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
        bar.update(task, description="runs", total=len(wanted), completed=len(rows.done & wanted))
        console.print(f"epsilon: {2 * preparations.force_median_n:.2f} N", markup=False)
        for row in run_cases(
            cases,
            runs,
            world,
            preparations,
            seed=seed,
            jobs=jobs,
            done=rows.done,
            scenes=out / "scenes",
        ):
            rows.add(row)
            bar.advance(task)
            console.print(_told(row), markup=False)
    asked = [row for row in rows.rows if row.key in wanted]
    notes = [
        f"World: {world}. Seed: {seed}. Force threshold: {2 * preparations.force_median_n:.3f} N, "
        "twice the median largest force over all rehearsals of the 17 configurations.",
        "F max true is the world's own force, which the executive never sees. The oracle runs the "
        "tree defras with the actual attachments as its belief.",
    ]
    _write(out, name, title, asked, notes)
    rows.discard()


def _write(out: Path, name: str, title: str, asked: Sequence[Row], notes: Sequence[str]) -> None:
    summary = success(asked)
    tables = {"Goal reached": summary, "Spread": spread(asked), "By case": by_case(asked)}
    write_benchmark(out, name, title, tables, notes)
    shown = Table(*summary[0])
    for line in summary:
        shown.add_row(*map(str, line.values()))
    Console().print(shown)
    typer.echo(f"Written to {out}: {name}.json, {name}.csv, {name}.html")


def _told(row: Row) -> str:
    seen = row.values.get("roi_visibility") or 0.0
    return f"{row.case} {row.relation}, {row.run}: {row.values['outcome']}, {seen:.0%} visible"
