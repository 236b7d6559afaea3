"""``defras view``: look at a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from defras_bt.cli.errors import UserError
from defras_bt.recording.viewer import ViewerMissing, screenshot, timeline_of
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
    try:
        timeline = timeline_of(run)
        if picture is None:
            code = open_viewer(timeline)
        else:
            if picture.is_dir() or not picture.parent.is_dir():
                raise UserError(f"--picture {picture}: give a PNG file in a folder that exists")
            screenshot(timeline, picture)
            code = 0
    except (ViewerMissing, OSError) as error:
        raise UserError(str(error)) from error
    if code != 0:
        raise UserError(f"the viewer ended with code {code}; without a screen, give --picture FILE")
