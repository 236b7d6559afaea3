"""``defras benchmark monitor``: what the discrepancy metrics notice of hidden mismatches."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.monitor import monitor_figure, monitor_tables
from defras_bt.benchmark.monitor_runs import MonitorRun, monitor_runs, retractions
from defras_bt.benchmark.preparations import prepared
from defras_bt.cli.files import folder_for
from defras_bt.cli.kept import rehearsals_in
from defras_bt.cli.progress import counting, sentences


def monitor(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    runs: Annotated[
        int, typer.Option(min=12, help="Retractions, each with a hidden mismatch and without.")
    ] = 240,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side.")] = 2,
) -> None:
    """What the paper's metric and the local one notice of hidden mismatches, and how soon.

    Retractions that the pre-operative search found good, each once as believed and once with extra,
    missing or torn attachments, a slip, a knocked camera or an unknown second tool.

    Example: defras benchmark monitor --out out/benchmark
    """
    folder_for(out)
    console = sentences()
    journal = rehearsals_in(out)
    done: list[MonitorRun] = []
    with counting(console) as bar:
        task = bar.add_task("rehearsing the 17 configurations", total=None)
        preparations = prepared(
            "model",
            jobs=jobs,
            journal=journal,
            progress=lambda ready, total: bar.update(task, completed=ready, total=total),
        )
        known = retractions(preparations)
        bar.update(task, description="retractions", total=runs, completed=0)
        for run in monitor_runs(known, 2 * preparations.force_median_n, runs, seed, jobs):
            done.append(run)
            bar.advance(task)
    minutes = sum(len(run.moved_m) * run.frame_s for run in done) / 60
    notes = [
        f"{runs} retractions ({minutes:.0f} min) with a hidden mismatch and as many without; "
        f"{len(known)} retractions to choose from. Seed: {seed}.",
        "The world has another mesh than the twin, with a mismatch and without. An alarm is two "
        "frames in a row over the threshold. Noticed: of the mismatches that move some part of the "
        "tissue, or of its picture, by 5 mm or more.",
    ]
    tables = {**monitor_tables(done), "By run": [_row(run) for run in done]}
    write_benchmark(
        out, "monitor", "What monitoring notices", tables, notes, [monitor_figure(done)]
    )
    for head in ("Both metrics", "Noticed, by mismatch"):
        shown = Table(*tables[head][0], title=head)
        for line in tables[head]:
            shown.add_row(*map(str, line.values()))
        Console().print(shown)
    typer.echo(f"Written to {out}: monitor.json, monitor.csv, monitor.html")


def _row(run: MonitorRun) -> dict[str, object]:
    kept = ("number", "kind", "scene", "starts")
    values = {key: value for key, value in asdict(run).items() if key in kept}
    return {
        **values,
        "point": "{}, {}".format(*run.point),
        "frames": len(run.moved_m),
        "moved mm": _mm(run.moved_m.max()),
        "off without mismatch mm": _mm(run.null_gap_m.max()),
        **{f"{name} mm": _mm(np.nanmax(mu)) for name, mu in run.mu_m.items()},
        **{f"{name} without mm": _mm(np.nanmax(mu)) for name, mu in run.null_mu_m.items()},
    }


def _mm(length_m: float) -> float:
    return round(1e3 * float(length_m), 2)
