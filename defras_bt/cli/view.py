"""``defras view``: look at a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from defras_bt.cli.errors import UserError
from defras_bt.recording.viewer import ViewerMissing, screenshot
from defras_bt.recording.viewer import view as open_viewer


def view(
    run: Annotated[Path, typer.Argument(help="Folder that defras run --out left.")],
    picture: Annotated[
        Path | None, typer.Option(help="Write a PNG instead of opening a window.")
    ] = None,
) -> None:
    """Open the timeline of a run in the rerun viewer.

    Example: defras view out/demo --picture timeline.png
    """
    timeline = run / "run.rrd"
    if not timeline.is_file():
        raise UserError(f"{run} holds no run.rrd; give a folder that defras run --out wrote")
    try:
        if picture is None:
            open_viewer(run)
        else:
            screenshot(timeline, picture)
    except ViewerMissing as error:
        raise UserError(str(error)) from error
