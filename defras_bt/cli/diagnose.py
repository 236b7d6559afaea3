"""``defras diagnose``: what the simulation gets wrong, and why."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from defras_bt.cli.diagnosis_data import Asked, Material, table_material, tissue_material
from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import find_scene, folder_for
from defras_bt.diagnosis.engine import diagnose as diagnosed
from defras_bt.diagnosis.recording_reader import UnusableRecording
from defras_bt.diagnosis.report_files import write_diagnosis
from defras_bt.diagnosis.report_terminal import print_diagnosis
from defras_bt.diagnosis.settings import Settings
from defras_bt.diagnosis.topic_map import read_topic_map
from defras_bt.diagnosis.verdict_file import Origin
from defras_bt.recording.versions import versions


class TwinKind(StrEnum):
    """What the data are of."""

    tissue = "tissue"
    arm = "arm"
    coupon = "coupon"


def diagnose(
    data: Annotated[
        list[Path],
        typer.Argument(help="Recordings (MCAP, bags, folders of defras run), or tables (CSV)."),
    ],
    scene: Annotated[
        str | None, typer.Option(help="Scene as believed then: a file, or a shipped name.")
    ] = None,
    twin: Annotated[
        TwinKind, typer.Option(help="What the data are of: a retraction, an arm, a specimen.")
    ] = TwinKind.tissue,
    topics: Annotated[
        Path | None, typer.Option(help="Topic map (YAML) of a laboratory's bags.")
    ] = None,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(help="Further data, on which the gain is measured and nothing is fitted."),
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option(help="Effects that are not to be looked for.")
    ] = None,
    may_stay: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1.0,
            help="Share of the error that a name may leave, with order in it; above that the "
            "verdict is outside. Usual: 0.02 for a retraction, 0.25 for arms and specimens.",
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=-1, help="Processes side by side; -1: one per core.")
    ] = -1,
    seed: Annotated[int, typer.Option(min=0, help="Of what chance is measured with.")] = 0,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder for what the diagnosis leaves.")
    ] = Path("diagnosis"),
) -> None:
    """Find out how and why a simulation differs from what was measured.

    Leaves verdict.json, report.html and diagnosis.rrd in --out, and for a retraction
    extended_scene.yaml, with which defras run goes on. The verdict names causes with intervals,
    or a set that this data cannot tell apart, or says that something is there that no known effect
    explains, or that nothing is. Every verdict is exit code 0; 2 is invalid input. Ctrl-C ends the
    search and keeps what was found.

    Example: defras diagnose out/demo --scene demo -o out/diagnosis

    Example: defras diagnose lab.bag --scene patient.yaml --topics lab.yaml --held-out second.bag

    Example: defras diagnose joints.csv --twin arm
    """
    if jobs == 0:
        raise UserError("--jobs 0: give a number of processes, or -1 for one per core")
    console = Console(soft_wrap=True, highlight=False)
    asked = Asked(tuple(data), tuple(held_out or ()), tuple(without or ()), jobs)
    scene_file: Path | None = None
    with _shown(console) as told:
        told("reading data", 0.0)
        try:
            if twin is TwinKind.tissue:
                if scene is None:
                    raise UserError(
                        "--scene is missing: a retraction is compared with what was believed of "
                        "the patient; give the scene file, or a shipped name such as demo"
                    )
                scene_file, believed = find_scene(scene)
                topic_map = None if topics is None else read_topic_map(topics)
                material = tissue_material(asked, believed, topic_map)
            else:
                if scene is not None or topics is not None:
                    raise UserError(
                        f"--twin {twin.value} takes tables; --scene and --topics are for recordings"
                    )
                material = table_material(asked, "arm" if twin is TwinKind.arm else "coupon")
        except UnusableRecording as error:
            raise UserError(str(error)) from error
        folder_for(out)
        _tell_quality(console, material)
        diagnosis = diagnosed(
            material.problem,
            np.random.default_rng(seed),
            settings=Settings(outside_share=may_stay),
            progress=told,
            beyond_range=material.beyond_range,
            new_grasp=material.new_grasp,
        )
        verdict = replace(diagnosis.verdict, data_quality=material.quality.as_data())
        diagnosis = replace(diagnosis, verdict=verdict)
        told("writing the report", 0.0)
        origin = Origin(
            twin=twin.value,
            data=[str(path) for path in data],
            scene=None if scene_file is None else str(scene_file),
            versions=versions(),
        )
        effects = {c.effect.name: c.effect for c in material.problem.candidates}.values()
        try:
            written = write_diagnosis(
                out,
                diagnosis,
                origin,
                effects,
                scene_file=scene_file,
                exhibits=material.exhibits(diagnosis),
            )
        except OSError as error:
            raise UserError(f"--out {out}: {error}") from error
    print_diagnosis(console, diagnosis, effects)
    names = ", ".join(file.name for file in written)
    console.print(f"Written to {out}: {names}", markup=False)
    raise typer.Exit(ExitCode.GOAL)


def _tell_quality(console: Console, material: Material) -> None:
    for fault in material.quality.faults:
        console.print(f"Data: {fault.sentence}.", style="yellow", markup=False)


@contextmanager
def _shown(console: Console) -> Iterator[Callable[[str, float], None]]:
    """A bar for every step of the diagnosis; off a terminal, a line for each."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=1.0)
        last = ""

        def told(sentence: str, share: float) -> None:
            nonlocal last
            bar.update(task, description=sentence, completed=share)
            # Steps that go through all effects would print a line for each.
            step = sentence.split(": fitting")[0].split(" would change")[0]
            if not console.is_terminal and step != last and "what " not in step[:5]:
                console.print(sentence, markup=False)
            last = step

        yield told
