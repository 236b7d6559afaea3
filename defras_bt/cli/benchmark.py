"""``defras benchmark``: measure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.planner import planning_times
from defras_bt.cli.benchmark_attachments import attachments
from defras_bt.cli.benchmark_blame import blame
from defras_bt.cli.benchmark_diagnosis import diagnosis
from defras_bt.cli.benchmark_dvrk_faults import dvrk_faults
from defras_bt.cli.benchmark_executive import executive
from defras_bt.cli.benchmark_faults import faults
from defras_bt.cli.benchmark_monitor import monitor
from defras_bt.cli.benchmark_probe import probe
from defras_bt.cli.benchmark_retraction import table1, table2
from defras_bt.cli.benchmark_stream import stream
from defras_bt.cli.benchmark_tissue import tissue
from defras_bt.cli.files import find_scene, folder_for

app = typer.Typer(help="Measure, and leave a JSON, a CSV and a page.", no_args_is_help=True)


@app.callback()
def benchmarks() -> None:
    """Measure, and leave NAME.json, NAME.csv and NAME.html."""


app.command("attachments")(attachments)
app.command("blame")(blame)
app.command("executive")(executive)
app.command("table1")(table1)
app.command("table2")(table2)
app.command("diagnosis")(diagnosis)
app.command("dvrk-faults")(dvrk_faults)
app.command("faults")(faults)
app.command("monitor")(monitor)
app.command("probe")(probe)
app.command("stream")(stream)
app.command("tissue")(tissue)


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
