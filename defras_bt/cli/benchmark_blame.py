"""``defras benchmark blame``: who is blamed for a mismatch, and what comes of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from defras_bt.benchmark.blame import ASKS, BLAMES, HIDDEN, draw_case, run_blame
from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.retraction import Row
from defras_bt.cli.files import folder_for
from defras_bt.cli.kept import rows_in
from defras_bt.cli.progress import counting, sentences


def blame(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    runs: Annotated[int, typer.Option(min=1, help="Runs of each kind, with either tree.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="The first one.")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side.")] = 2,
    resume: Annotated[bool, typer.Option(help="Go on with the rows already in the folder.")] = (
        False
    ),
) -> None:
    """Retractions with a hidden slip, a bumped camera, an arm that is off, other attachments.

    Each is run with trees/defras.yaml, which asks who is to blame for a mismatch, and with the same
    tree that always learns attachments.

    Example: defras benchmark blame --runs 10 --out out/benchmark
    """
    folder_for(out)
    console = sentences()
    rows = rows_in(out, "blame", f"blame, seed {seed}", resume=resume)
    cases = [draw_case(hidden, number) for number in range(seed, seed + runs) for hidden in HIDDEN]
    with counting(console) as bar:
        task = bar.add_task("runs", total=2 * len(cases), completed=len(rows.done))
        for row in run_blame(cases, jobs=jobs, done=rows.done):
            rows.add(row)
            bar.advance(task)
            said = row.values["blamed"] or "nobody"
            console.print(f"{row.case}, {row.run}: {said}, {row.values['outcome']}", markup=False)
    wanted = {case.name for case in cases}
    asked = [row for row in rows.rows if row.case in wanted]
    summary = summed_up(asked)
    notes = [
        f"World: model. Seeds: {seed} to {seed + runs - 1}. Patients: sim1 to sim8.",
        "named: runs in which the one to blame was named (with nothing hidden: nobody); wrong: "
        "runs in which somebody else was. off: 95th percentile of how far the twin is from the "
        "actual tissue at the end. F max: the world's own.",
    ]
    write_benchmark(
        out,
        "blame",
        "Who is blamed for a mismatch",
        {"By kind": summary, "Runs": _runs(asked)},
        notes,
    )
    rows.discard()
    shown = Table(*summary[0])
    for line in summary:
        shown.add_row(*("-" if v is None else str(v) for v in line.values()))
    Console().print(shown)
    typer.echo(f"Written to {out}: blame.json, blame.csv, blame.html")


def summed_up(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One line per kind and tree."""
    lines = []
    for hidden in HIDDEN:
        for tree in (ASKS, BLAMES):
            mine = [r.values for r in rows if r.case.split()[0] == hidden and r.run == tree]
            if not mine:
                continue
            lines.append(
                {
                    "hidden": hidden,
                    "tree": tree,
                    "runs": len(mine),
                    "warned": sum(v["warned"] for v in mine),
                    "named": sum(v["right"] for v in mine),
                    "wrong": sum(v["wrong"] for v in mine),
                    "goal": sum(v["outcome"] == "goal" for v in mine),
                    "human": sum(v["outcome"] == "human" for v in mine),
                    "off, median [mm]": _middle([v["off_mm"] for v in mine]),
                    "off, worst [mm]": _worst([v["off_mm"] for v in mine]),
                    "F max, worst [N]": _worst([v["force_max_true_n"] for v in mine]),
                }
            )
    return lines


def _runs(rows: Sequence[Row]) -> list[dict[str, Any]]:
    return [
        {"case": row.case, "to blame": row.relation, "tree": row.run, **row.values} for row in rows
    ]


def _known(values: Sequence[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _middle(values: Sequence[float | None]) -> float | None:
    known = _known(values)
    return round(float(np.median(known)), 2) if known else None


def _worst(values: Sequence[float | None]) -> float | None:
    known = _known(values)
    return round(max(known), 2) if known else None
