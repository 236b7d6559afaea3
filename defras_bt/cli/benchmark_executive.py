"""``defras benchmark executive``: what the executive costs per tick."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from defras_bt.benchmark.executive import measure
from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.files import find, find_scene, folder_for


def executive(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    tree: Annotated[str, typer.Option(help="Tree: a file, or a shipped name.")] = "defras",
    scene: Annotated[str, typer.Option(help="Scene: a file, or a shipped name.")] = "demo",
    actions: Annotated[int, typer.Option(min=1, help="Length of the plan carried out.")] = 30,
    repeats: Annotated[int, typer.Option(min=1, help="Times that it is carried out.")] = 5,
) -> None:
    """Cost of a tick without world, twin and drawing, beside bare py_trees on the same tree.

    Example: defras benchmark executive --out out/benchmark
    """
    tree_file, (_, believed) = find(tree, "trees"), find_scene(scene)
    folder_for(out)
    load_before = os.getloadavg()[0]
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("carrying out the plan", total=repeats)
        rows = measure(tree_file, believed, actions, repeats, lambda: progress.advance(task))
    load = f"{load_before:.1f} before and {os.getloadavg()[0]:.1f} after"
    notes = [
        f"Tree {tree}, a plan of {actions} actions, carried out {repeats} times; scene {scene}.",
        "CPU: of the thread that ticks, of each tick the least of all repeats. Wall: as it came. "
        "Ratios: of CPU time to bare py_trees.",
        "executive: monitoring (each new cloud against the twin), reading checks, tree, reasons, "
        "gate; recording: all files that are written while a run lasts. Neither holds world, twin, "
        "drawing, nor colours in pictures: the world delivers cloud and visibility.",
        f"Load of the machine ({os.cpu_count()} processors): {load}.",
    ]
    write_benchmark(out, "executive", "The executive's own time", {"Per tick": rows}, notes)
    table = Table(*rows[0], box=None)
    for row in rows:
        table.add_row(*map(str, row.values()))
    # In a file, a row of numbers should not be broken.
    console = Console() if Console().is_terminal else Console(width=120)
    console.print(table)
    for note in notes:
        console.print(note)
    typer.echo(f"Written to {out}: executive.json, executive.csv, executive.html")
