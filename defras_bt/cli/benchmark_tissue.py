"""``defras benchmark tissue``: the tissue model beside others."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for


def tissue(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    quick: Annotated[bool, typer.Option("--quick", help="One motion only: a minute.")] = False,
) -> None:
    """Force, shape and speed of the tissue model beside felupe, PyBullet and MuJoCo flex.

    All are measured against a converged solution on five motions, in one run.

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
    from defras_bt.benchmark.tissue_plot import tissue_figure

    cases: list[Case] = []
    sizes: list[Growth] = []
    said = notes(quick=quick)
    todo = list(works(quick=quick))
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("cases", total=len(todo))
        for work in todo:
            progress.update(task, description=work.title)
            found = work.run()
            if isinstance(found, Case):
                cases.append(found)
            else:
                sizes.append(found)
            progress.console.print(str(found))
            progress.advance(task)
            # An interrupted run leaves what it has measured.
            tables = {
                "Targets": targets(cases),
                "Growth with the mesh": [size.row() for size in sizes],
                "Every model and motion": [case.row() for case in cases],
            }
            figure = tissue_figure(cases, sizes)
            write_benchmark(out, "tissue", "Models of tissue side by side", tables, said, [figure])
    table = Table("", "measured", "target", "met")
    for line in targets(cases):
        table.add_row(*(_said(value) for value in line.values()))
    Console().print(table)
    typer.echo(f"Written to {out}: tissue.json, tissue.csv, tissue.html")


def _said(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
