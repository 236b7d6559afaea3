"""``defras benchmark``: measure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.planner import planning_times
from defras_bt.benchmark.table1 import BELIEVED, RELATIONS, TREES, Row, table1
from defras_bt.benchmark.table1_summary import by_case, by_tree
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import find_scene, folder_for
from defras_bt.executive.operation import WORLDS

app = typer.Typer(help="Measure, and leave a JSON, a CSV and a page.", no_args_is_help=True)


@app.callback()
def benchmarks() -> None:
    """Measure, and leave NAME.json, NAME.csv and NAME.html."""


@app.command("table1")
def run_table1(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    world: Annotated[str, typer.Option(help="model or bullet.")] = "model",
    trees: Annotated[str, typer.Option(help="Trees, separated by commas.")] = ",".join(TREES),
    seed: Annotated[int, typer.Option(min=0)] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side.")] = 2,
) -> None:
    """The paper's 16 simulated cases: fewer and more attachments than believed, each tree.

    Example: defras benchmark table1 --world model --out out/benchmark
    """
    if world not in WORLDS:
        raise UserError(f"--world {world}: valid are {', '.join(WORLDS)}")
    names = trees.split(",")
    unknown = [name for name in names if name not in TREES]
    if unknown:
        raise UserError(f"--trees {','.join(unknown)}: valid are {', '.join(TREES)}")
    rows: list[Row] = []
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("runs", total=len(BELIEVED) * len(RELATIONS) * len(names))
        for row in table1(world, names, seed, jobs):
            rows.append(row)
            seen = row.values.get("roi_visibility") or 0.0
            progress.console.print(
                f"{row.scene} {row.relation}, {row.tree}: {row.values['outcome']}, "
                f"{seen:.0%} visible"
            )
            progress.advance(task)
    summary, cases = by_tree(rows), by_case(rows)
    write_benchmark(
        out,
        "table1",
        f"Fewer and more attachments than believed ({world} world)",
        {"By tree (median / mean / worst)": summary, "By case": cases},
        [f"World: {world}. Seed: {seed}. F max true is the world's own force."],
    )
    table = Table(*summary[0])
    for line in summary:
        table.add_row(*map(str, line.values()))
    Console().print(table)
    typer.echo(f"Written to {out}: table1.json, table1.csv, table1.html")


@app.command("planner")
def run_planner(
    scene: Annotated[str, typer.Argument(help="Scene: a file, or a shipped name.")] = "demo",
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    seed: Annotated[int, typer.Option(min=0)] = 0,
    count: Annotated[int, typer.Option(min=10, help="Plans on a small grid.")] = 100,
) -> None:
    """Re-planning with one live clingo control, beside a fresh control for every plan.

    Example: defras benchmark planner --out out/benchmark
    """
    _, believed = find_scene(scene)
    folder_for(out)
    rows = []
    for timing in planning_times(believed, seed, count=count):
        rows.append(timing.row())
        typer.echo(", ".join(f"{key} {value}" for key, value in rows[-1].items()))
    notes = [
        f"Scene: {believed.name}. Seed: {seed}. Seconds of computing of one process.",
        "Both ways gave the same plans; every plan is proved shortest.",
    ]
    write_benchmark(out, "planner", "Planning, warm and fresh", {"By grid": rows}, notes)
    typer.echo(f"Written to {out}: planner.json, planner.csv, planner.html")
