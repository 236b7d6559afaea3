"""``defras scene``: make, check and draw scenes."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene, folder_for
from defras_sim.scene_file import write_scene, write_variant
from defras_sim.scene_generator import NoScene, generate_scene
from defras_sim.scene_picture import draw_scene

app = typer.Typer(help="Make, check and draw scenes.", no_args_is_help=True)
Named = Annotated[str, typer.Argument(help="Scene: a file, or a shipped name.")]


class Actual(StrEnum):
    """How many holes really hold, compared with the belief."""

    fewer = "fewer"
    more = "more"
    equal = "equal"


@app.command("new")
def new(
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same scene.")],
    actual: Annotated[Actual, typer.Option(help="Real attachments against belief.")] = Actual.fewer,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the files.")] = Path("."),
) -> None:
    """Make a scene and its actual one from a seed.

    Writes seedN.yaml (believed) and seedN_fewer.yaml (actual; or _more, _equal). Only scenes are
    kept in which somebody who knows the attachments can expose the region; finding one takes up to
    several minutes.

    Example: defras scene new --seed 7 --actual more -o scenes
    """
    console = Console(soft_wrap=True, highlight=False)
    folder_for(out)
    with console.status("drawing scenes and rehearsing retractions"):
        try:
            generated = generate_scene(seed, actual.value)
        except NoScene as error:
            raise UserError(str(error)) from error
    believed, truth = generated.believed.scene, generated.actual.scene
    believed_file, actual_file = out / f"{believed.name}.yaml", out / f"{truth.name}.yaml"
    write_scene(believed, believed_file)
    write_variant(truth, believed_file.name, actual_file)
    solution = generated.actual.solution
    console.print(f"{believed_file}: {believed.description}", markup=False)
    console.print(f"{actual_file}: {truth.description}", markup=False)
    console.print(
        f"Knowing the truth, {solution.arm.upper()} exposes {solution.best_visibility:.0%} from "
        f"grasp point {solution.point} by {' and '.join(solution.manoeuvres)}.",
        markup=False,
    )


@app.command("check")
def check(scene: Named) -> None:
    """Check a scene file: every fault with its place. Example: defras scene check mine.yaml"""
    file, found = find_scene(scene)
    typer.echo(
        f"{file}: {found.name} is valid; {int(found.attached.sum())} of {found.attached.size} "
        f"holes hold, {found.grasp.columns} x {found.grasp.rows} grasp points"
    )


@app.command("show")
def show(
    scene: Named,
    actual: Annotated[str | None, typer.Option(help="Mark where this scene differs.")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="PNG file.")] = None,
) -> None:
    """Draw a scene to PNG. Example: defras scene show demo --actual demo_actual -o demo.png"""
    file, found = find_scene(scene)
    truth = find_scene(actual)[1] if actual is not None else None
    picture = out or Path(f"{file.stem}.png")
    if picture.is_dir() or not picture.suffix:
        raise UserError(f"--out {picture}: give the name of a file, as in {file.stem}.png")
    try:
        draw_scene(found, picture, truth)
    except (OSError, ValueError) as error:
        raise UserError(f"{picture} could not be written: {error}") from error
    typer.echo(f"Drawn to {picture}")
