"""``defras benchmark attachments``: estimators of the attachments on the same updates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from defras_bt.benchmark.attachment_cases import (
    FIRST_SEED,
    otherwise_wrong,
    wrongly_believed,
)
from defras_bt.benchmark.attachment_summary import run_rows, summed_up, torn_down
from defras_bt.benchmark.attachments import NOBODY, run_updates
from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for
from defras_bt.cli.kept import rows_in
from defras_bt.cli.progress import counting, sentences
from defras_bt.executive.operation import SIMULATED_WORLDS
from defras_bt.learning.chain.estimators import ESTIMATORS, EstimatorName


def attachments(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    world: Annotated[str, typer.Option(help="model or bullet.")] = "model",
    updates: Annotated[int, typer.Option(min=1, help="Seeds with other attachments.")] = 300,
    others: Annotated[int, typer.Option(min=0, help="Seeds of each other mismatch.")] = 25,
    estimators: Annotated[str, typer.Option(help="Names with commas between.")] = (
        ",".join(ESTIMATORS)
    ),
    seed: Annotated[int, typer.Option(min=0, help="The first one.")] = FIRST_SEED,
    jobs: Annotated[int, typer.Option(min=1, help="Seeds side by side.")] = 1,
    resume: Annotated[bool, typer.Option(help="Go on with the rows already in the folder.")] = (
        False
    ),
) -> None:
    """Retractions are led until monitoring warns; then every estimator is asked about the same.

    Half of the seeds have fewer attachments than believed, half have more. Other mismatches are
    slips, bumped cameras, unknown second tools and (in the model world, whose tissue need not be
    the same all over) stiff spots, for which nothing should change.
    Rows stay in the folder, so that --resume with more updates goes on from them.

    Example: defras benchmark attachments --world bullet --updates 60 --others 5
    """
    folder_for(out)
    if world not in SIMULATED_WORLDS:
        raise UserError(f"--world {world}: valid are {' and '.join(SIMULATED_WORLDS)}")
    names = _names(estimators)
    console = sentences()
    name = f"attachments_{world}"
    question = f"attachments, {world}, {','.join(names)}, seed {seed}"
    rows = rows_in(out, name, question, resume=resume)
    cases = [*wrongly_believed(seed, updates), *otherwise_wrong(seed, others, world)]
    with counting(console) as bar:
        ready = sum(row.run == NOBODY for row in rows.rows)
        task = bar.add_task("updates", total=len(cases), completed=ready)
        for row in run_updates(cases, names, world, jobs=jobs, done=rows.done):
            rows.add(row)
            if row.run == NOBODY:
                bar.advance(task)
    wanted = {f"{hidden} {number}" for hidden, number in cases}
    asked = [row for row in rows.rows if row.case in wanted]
    summary = summed_up(asked, names)
    notes = [
        f"World: {world}. Seeds: from {seed}. An update is asked for in warning state 1 or 2 of "
        "the local metric; seeds that end without a warning are left out.",
        "back: share of updates after which the discrepancy is under its first threshold, by the "
        "local and by the paper's median metric. Surface: median distance of the actual upper face "
        "from the twin's. Force: error of the twin's grasp force relative to the world's.",
    ]
    tables = {
        "Other attachments": summary,
        "Other mismatches": torn_down(asked, names),
        "Updates": run_rows(asked),
    }
    write_benchmark(out, name, "Learning attachments", tables, notes)
    if summary:
        # One column per estimator: there are more numbers than a terminal is wide.
        shown = Table("", *(str(line["estimator"]) for line in summary))
        for key in list(summary[0])[1:]:
            shown.add_row(escape(key), *(str(line[key]) for line in summary))
        Console().print(shown)
    typer.echo(f"Written to {out}: {name}.json, {name}.csv, {name}.html")


def _names(text: str) -> list[EstimatorName]:
    known: dict[str, EstimatorName] = {name: name for name in ESTIMATORS}
    asked = [each.strip() for each in text.split(",") if each.strip()]
    unknown = [each for each in asked if each not in known]
    if unknown or not asked:
        raise UserError(f"--estimators {text}: valid are {', '.join(ESTIMATORS)}")
    return [known[each] for each in asked]
