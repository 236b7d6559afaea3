"""``defras benchmark faults``: the fault campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from defras_bt.benchmark.faults import FaultRun, by_kind, by_run, campaign, passed
from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.errors import ExitCode, UserError
from defras_bt.cli.files import folder_for
from defras_bt.faults.faults import KINDS

_NOTES = (
    "World: model, on a coarse mesh. In every fifth run the patient is held in more places than "
    "believed. Each run has one fault, drawn with its start, duration and other values.",
    "Had to stop: runs in which a fault had to keep the arms still. What counts against a run: "
    "motion that was sent later than one tick after that, too fast, or with an arm that had lost "
    "its tissue; a timeline, recording or run.json that cannot be read or lacks more than a second "
    "before its end (before the disk was full or the process killed); an exception that nobody "
    "caught; an end without a reason.",
)

_WIDTH = 190


def faults(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    seeds: Annotated[int, typer.Option(min=1, help="Runs of each kind.")] = 20,
    kinds: Annotated[str, typer.Option(help="Kinds of faults, separated by commas.")] = "all",
    tree: Annotated[str, typer.Option(help="defras, defras_paper or fras.")] = "defras",
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side.")] = 2,
) -> None:
    """Every kind of fault many times, each run judged from outside; exit code 3 if one fails.

    Example: defras benchmark faults --seeds 2 --kinds frozen,killed --out out/benchmark
    """
    chosen = list(KINDS) if kinds == "all" else kinds.split(",")
    unknown = [kind for kind in chosen if kind not in KINDS]
    if unknown:
        raise UserError(f"--kinds {','.join(unknown)}: valid are all, {', '.join(KINDS)}")
    trees = ("defras", "defras_paper", "fras")
    if tree not in trees:
        raise UserError(f"--tree {tree}: valid are {', '.join(trees)}")
    folder_for(out)
    runs: list[FaultRun] = []
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("runs", total=len(chosen) * seeds)
        for run in campaign(chosen, range(seeds), jobs, tree):
            runs.append(run)
            found = run.verdict
            progress.console.print(
                f"{run.kind} at {run.start_s:.1f} s, seed {run.seed}: {found.outcome}; "
                f"late motion {found.late}, lost recordings {len(found.lost)}. {found.reason}",
                highlight=False,
                markup=False,
            )
            progress.advance(task)
    summary = by_kind(runs)
    tables = {"By kind of fault": summary, "By run": by_run(runs)}
    write_benchmark(out, "faults", f"Fault campaign, tree {tree}", tables, _NOTES)
    table = Table(*summary[0], box=None)
    for line in summary:
        table.add_row(*map(str, line.values()))
    # In a file or a narrow window, a row of numbers should not be broken.
    Console(width=max(Console().width, _WIDTH)).print(table)
    typer.echo(f"Written to {out}: faults.json, faults.csv, faults.html")
    if not passed(runs):
        raise typer.Exit(ExitCode.NOT_REACHED)
