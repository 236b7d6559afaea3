"""``defras benchmark stream``: how regular set-points are while the twin computes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.stream import measure
from defras_bt.cli.files import find_scene, folder_for


def stream(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    scene: Annotated[str, typer.Option(help="Scene: a file, or a shipped name.")] = "demo",
    seconds: Annotated[float, typer.Option(min=2, help="For each way to stream.")] = 20.0,
) -> None:
    """Times between set-points in a thread beside the twin, and in a process of their own.

    Two arms without physics answer over UDP on the loopback. Needs no ROS.

    Example: defras benchmark stream --seconds 60
    """
    believed = find_scene(scene)[1]
    folder_for(out)
    load_before = os.getloadavg()[0]
    rows = []
    for timing in measure(believed, seconds):
        rows.append(timing.row())
        typer.echo(", ".join(f"{key} {_short(value)}" for key, value in rows[-1].items()))
    notes = [
        f"Scene {scene}; the twin follows a pull at 15 mm/s meanwhile, 20 ticks per second.",
        f"{seconds:g} s each way. Wall time, as it came.",
        f"Load of the machine ({os.cpu_count()} processors): {load_before:.1f} before and "
        f"{os.getloadavg()[0]:.1f} after.",
    ]
    write_benchmark(out, "stream", "The stream of set-points", {"By way": rows}, notes)
    table = Table(*rows[0], box=None)
    for row in rows:
        table.add_row(*(_short(value) for value in row.values()))
    console = Console() if Console().is_terminal else Console(width=200)
    console.print(table)
    for note in notes:
        console.print(note)
    typer.echo(f"Written to {out}: stream.json, stream.csv, stream.html")


def _short(value: object) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)
