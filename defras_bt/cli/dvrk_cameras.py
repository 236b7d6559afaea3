"""``defras dvrk cameras``: what cameras see, and what of it is tissue."""

from __future__ import annotations

from functools import partial
from io import StringIO
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from ruamel.yaml import YAML

from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for
from defras_bt.dvrk.camera_settings import Colours, Hsv
from defras_bt.dvrk.cameras.calibration_data import CameraView, NoCameraData, read_views
from defras_bt.dvrk.cameras.calibration_pictures import draw_view
from defras_bt.dvrk.cameras.colour_fit import OutsidePicture, fitted
from defras_bt.dvrk.settings import load_setup
from defras_bt.recording.whole_file import write_whole
from defras_bt.sensing.cloud import VOXEL_M

app = typer.Typer(no_args_is_help=True, help="What cameras see, and what of it is tissue.")

SETTINGS = "colours.yaml"

Places = Annotated[
    list[str] | None,
    typer.Option(help="COLUMN,ROW of a place that surely is; may be given several times."),
]


@app.callback()
def _group() -> None:
    """Keeps the command's own name, also while it is the only one."""


@app.command()
def calibrate(
    data: Annotated[
        Path, typer.Argument(help="A bag, an .npz of clouds (frames, points, 3), or an image.")
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder for pictures and settings.")
    ] = Path("out/cameras"),
    setup: Annotated[
        Path | None, typer.Option(help="Set-up file whose colours to begin with.")
    ] = None,
    tissue: Places = None,
    roi: Places = None,
    voxel: Annotated[
        float, typer.Option(min=1e-4, max=0.1, help="Edge (m) of the cubes that leave one point.")
    ] = VOXEL_M,
    views: Annotated[int, typer.Option(min=1, max=20, help="Most of each topic.")] = 4,
) -> None:
    """Show what is taken for tissue and for the region of interest, and find the colours for it.

    Leaves one picture per view, and colours.yaml for the set-up file's cameras. Places given with
    --tissue and --roi are looked up in the first view with a picture; without them the colours of
    the set-up, or the usual ones, are shown. Exit code: 0, or 2 for data without cameras.

    Example: defras dvrk cameras calibrate camera.bag --tissue 160,120 --roi 88,140 -o out/cameras
    """
    colours = load_setup(setup).cameras.colours if setup is not None else Colours()
    console = Console(soft_wrap=True, highlight=False)
    leaving_out = partial(console.print, style="yellow", markup=False)
    try:
        found = read_views(data, views, leaving_out)
        colours = colours.model_copy(update=_fits(found, tissue or [], roi or []))
    except (NoCameraData, OutsidePicture) as error:
        raise UserError(str(error)) from error
    folder_for(out)
    for number, view in enumerate(found, start=1):
        told = draw_view(view, colours, voxel, out / f"view_{number:02d}.png")
        console.print(told, markup=False)
    text = StringIO()
    YAML().dump({"cameras": {"colours": colours.model_dump(mode="json")}}, text)
    write_whole(out / SETTINGS, text.getvalue())
    console.print(f"Written to {out}: {len(found)} pictures, {SETTINGS}", markup=False)


def _fits(views: list[CameraView], tissue: list[str], roi: list[str]) -> dict[str, Hsv]:
    """The ranges asked for, from the first view with a picture."""
    if not tissue and not roi:
        return {}
    for view in views:
        rgb = view.rgb
        if rgb is None and view.cloud is not None and view.cloud.is_picture:
            rgb = view.cloud.rgb
        if rgb is not None:
            asked = {"tissue": tissue, "roi": roi}
            return {
                name: fitted(rgb, [_place(text) for text in places])
                for name, places in asked.items()
                if places
            }
    raise NoCameraData("there is no picture in which --tissue or --roi could be looked up")


def _place(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise UserError(f"{text!r} is no place; give COLUMN,ROW as 160,120")
    return int(parts[0]), int(parts[1])
