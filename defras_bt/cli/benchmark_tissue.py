"""``defras benchmark tissue``: the tissue model beside others."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for

_PATHS, _PATHS_QUICK = 200, 8
# For so many paths it is required that nearly every step converges.
_PATHS_REQUIRED = 2000


def tissue(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    quick: Annotated[bool, typer.Option("--quick", help="One motion only: a minute.")] = False,
    paths: Annotated[
        int | None,
        typer.Option(
            min=0,
            help=f"Random paths of the tool; {_PATHS} if not said. "
            f"The full requirement is --paths {_PATHS_REQUIRED}.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the random paths.")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Random paths side by side.")] = 2,
) -> None:
    """Force, shape and speed of the tissue model beside felupe, PyBullet and MuJoCo flex.

    All are measured against a converged solution on five motions, in one run. Random paths of the
    tool follow, on this project's model alone.

    Example: defras benchmark tissue --quick --out out/benchmark
    """
    folder_for(out)
    try:
        from defras_bt.benchmark.tissue import Case, Growth, notes, targets, works
    except ModuleNotFoundError as error:
        raise UserError(
            f"this benchmark compares with felupe, and {error.name} is not installed; "
            "install the extra: pip install 'defras[bench]'"
        ) from error
    from defras_bt.benchmark.tissue_bed import OverBed, bed_row
    from defras_bt.benchmark.tissue_paths import PathResult, failures, run_paths, summary
    from defras_bt.benchmark.tissue_plot import tissue_figure

    cases: list[Case] = []
    sizes: list[Growth] = []
    beds: list[OverBed] = []
    ends: list[PathResult] = []
    said = notes(quick=quick)

    def write() -> None:
        """An interrupted run leaves what it has measured."""
        tables = {
            "Targets": targets(cases, ends),
            "Random paths": [asdict(summary(ends))],
            "Random paths that failed somewhere": failures(ends),
            "Over a bed": [run.row() for run in beds] + ([bed_row(beds)] if beds else []),
            "Growth with the mesh": [size.row() for size in sizes],
            "Every model and motion": [case.row() for case in cases],
        }
        figure = tissue_figure(cases, sizes)
        write_benchmark(out, "tissue", "Models of tissue side by side", tables, said, [figure])

    todo = list(works(quick=quick))
    count = paths if paths is not None else (_PATHS_QUICK if quick else _PATHS)
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("cases", total=len(todo) + count)
        for work in todo:
            progress.update(task, description=work.title)
            found = work.run()
            if isinstance(found, Case):
                cases.append(found)
            elif isinstance(found, OverBed):
                beds.append(found)
            else:
                sizes.append(found)
            progress.console.print(str(found))
            progress.advance(task)
            write()
        progress.update(task, description="random paths")

        def told(result: PathResult) -> None:
            ends.append(result)
            progress.advance(task)

        if count:
            run_paths(count, seed, jobs, told=told)
            write()
    table = Table("", "measured", "target", "met")
    for line in targets(cases, ends):
        table.add_row(*(_said(value) for value in line.values()))
    Console().print(table)
    paths_said = summary(ends)
    typer.echo(
        f"{paths_said.paths} random paths: {paths_said.converged:.3%} of {paths_said.steps} steps "
        f"converged, {paths_said.untrue} not finite, {paths_said.errors} errors"
    )
    typer.echo(f"Written to {out}: tissue.json, tissue.csv, tissue.html")


def _said(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
