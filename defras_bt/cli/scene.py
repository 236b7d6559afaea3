"""``defras scene``: make, check and draw scenes."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene, folder_for, require_folder
from defras_sim.anatomy.building import built
from defras_sim.anatomy.mesher import unknowns_of
from defras_sim.anatomy.quality import qualities
from defras_sim.anatomy.reading import METRES, read_surface
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.repair import sound_surface
from defras_sim.anatomy.solid import tissue_of
from defras_sim.scene_file import write_scene, write_variant
from defras_sim.scene_from_surface import believed_scene, require_rest
from defras_sim.scene_generator import NoScene, generate_scene
from defras_sim.scene_picture import draw_scene

app = typer.Typer(help="Make, check and draw scenes.", no_args_is_help=True)
# Of a flap; thicker tissue is given as a closed surface.
_THINNEST_M, _THICKEST_M = 0.0005, 0.03
Named = Annotated[str, typer.Argument(help="Scene: a file, or a shipped name.")]


class LengthUnit(StrEnum):
    """What a coordinate of 1 in a surface's file means."""

    mm = "mm"
    cm = "cm"
    m = "m"


class UpAxis(StrEnum):
    """An axis of a surface's file."""

    x = "x"
    minus_x = "-x"
    y = "y"
    minus_y = "-y"
    z = "z"
    minus_z = "-z"


class HeldEdge(StrEnum):
    """An edge of the tissue as the endoscope sees it."""

    far = "far"
    near = "near"
    left = "left"
    right = "right"


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
    several minutes, and each draw is told.

    Example: defras scene new --seed 7 --actual more -o scenes
    """
    console = Console(soft_wrap=True, highlight=False)
    folder_for(out)
    with console.status("drawing scenes and rehearsing retractions") as status:

        def tell(sentence: str) -> None:
            status.update(sentence)
            if not console.is_terminal:
                console.print(sentence, markup=False)

        try:
            generated = generate_scene(seed, actual.value, tell=tell)
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


@app.command("from-mesh")
def from_mesh(
    surface: Annotated[Path, typer.Argument(help="Surface of the organ: STL, OBJ or PLY.")],
    unit: Annotated[LengthUnit, typer.Option(help="Unit of the file, which does not say it.")],
    thickness: Annotated[
        str | None, typer.Option(help="Of a flap, as in 5mm; without it the surface is closed.")
    ] = None,
    up: Annotated[UpAxis, typer.Option(help="Axis of the file that points up.")] = UpAxis.z,
    held: Annotated[
        HeldEdge, typer.Option(help="Edge that holds, as the endoscope sees it.")
    ] = HeldEdge.far,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Scene file; default: NAME.yaml here.")
    ] = None,
) -> None:
    """Make a scene of a patient's anatomy from its surface.

    A sheet, open along one rim, is the upper face of tissue of that --thickness. A closed surface
    is the tissue itself; with --thickness, its upper side is that of a flap. Duplicate vertices,
    flipped triangles and small holes are mended, and said; what else is wrong is refused.

    Writes NAME.yaml, to be edited (attachments, region, material), and NAME.npz with the meshes.

    Example: defras scene from-mesh liver.stl --unit mm --thickness 5mm -o liver.yaml
    """
    console = Console(soft_wrap=True, highlight=False)
    file = out or Path(f"{surface.stem}.yaml")
    if file.is_dir() or file.suffix != ".yaml":
        raise UserError(f"--out {file}: give the name of a file, as in {surface.stem}.yaml")
    if not surface.is_file():
        raise UserError(f"there is no file {surface}")
    thickness_m = None if thickness is None else _length_m("--thickness", thickness)
    require_folder(file)
    try:
        with console.status("reading the surface") as status:
            sound = sound_surface(read_surface(surface, unit.value, up.value))
            tissue = tissue_of(sound, thickness_m)
            anatomy = built(tissue, file.with_suffix(".npz"), status.update)
            made = believed_scene(
                anatomy,
                name=file.stem,
                description=f"Anatomy from {surface.name}.",
                thickness_m=thickness_m,
                held=held.value,
            )
            status.update("looking whether the tissue lies still")
            require_rest(made)
    except RefusedSurface as error:
        said = str(error)
        # What is wrong with the file itself names it already.
        raise UserError(said if said.startswith(str(surface)) else f"{surface}: {said}") from error
    write_scene(made, file)
    for repair in sound.repairs:
        console.print(f"Mended: {repair}.", markup=False)
    size_mm = 1e3 * (anatomy.high_m - anatomy.low_m)
    console.print(
        f"{file}: {size_mm[0]:.0f} x {size_mm[1]:.0f} x {size_mm[2]:.0f} mm, "
        f"{int(made.attached.sum())} of {int(made.is_hole.sum())} holes hold along the {held} "
        f"edge, {len(made.grasp_points)} grasp points.",
        markup=False,
    )
    for name, mesh in anatomy.meshes.items():
        console.print(
            f"Mesh of the {name} tissue: {len(mesh.tetrahedra)} tetrahedra, {unknowns_of(mesh)} "
            f"unknowns, quality at least {qualities(mesh).min():.2f}.",
            markup=False,
        )


@app.command("check")
def check(scene: Named) -> None:
    """Check a scene file: every fault with its place. Example: defras scene check mine.yaml"""
    file, found = find_scene(scene)
    typer.echo(
        f"{file}: {found.name} is valid; {int(found.attached.sum())} of {int(found.is_hole.sum())} "
        f"holes hold, {len(found.grasp_points)} grasp points"
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


def _length_m(option: str, text: str) -> float:
    """A length with its unit, as in ``5mm``."""
    found = re.fullmatch(r"\s*([0-9]*\.?[0-9]+)\s*(mm|cm|m)\s*", text)
    if found is None:
        raise UserError(f"{option} {text}: give a length with its unit, as in 5mm or 0.005m")
    length_m = float(found[1]) * METRES[LengthUnit(found[2]).value]
    if not _THINNEST_M <= length_m <= _THICKEST_M:
        raise UserError(
            f"{option} {text}: valid is {1e3 * _THINNEST_M:g}mm to {1e3 * _THICKEST_M:g}mm"
        )
    return length_m
