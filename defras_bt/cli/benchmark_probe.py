"""``defras benchmark probe``: whether a tug tells more about attachments than going on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from defras_bt.benchmark.attachment_cases import FIRST_SEED, wrongly_believed
from defras_bt.benchmark.files import write_benchmark
from defras_bt.benchmark.intervals import LEAST_PAIRS
from defras_bt.benchmark.preparations import FORCE_THRESHOLD_N
from defras_bt.benchmark.probe import BEFORE, run_probes
from defras_bt.benchmark.probe_summary import compared, frequencies, run_rows, verdict
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for
from defras_bt.cli.kept import rows_in
from defras_bt.cli.progress import counting, sentences
from defras_bt.executive.operation import SIMULATED_WORLDS


def probe(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    world: Annotated[str, typer.Option(help="model or bullet.")] = "model",
    updates: Annotated[int, typer.Option(min=1, help="Seeds.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="The first one.")] = FIRST_SEED,
    jobs: Annotated[int, typer.Option(min=1, help="Seeds side by side.")] = 1,
    resume: Annotated[bool, typer.Option(help="Go on with the rows already in the folder.")] = (
        False
    ),
) -> None:
    """Where learning leaves attachments in doubt: a tug, or as much of the planned motion instead.

    Retractions are led until monitoring warns, and the chain is asked. Where there is a safe tug,
    it is asked again after it, and, in the same retraction led again, after going on as planned.
    Half of the seeds have fewer attachments than believed, half have more. Rows stay in the folder,
    so that --resume with more updates goes on from them.

    Example: defras benchmark probe --world model --updates 60
    """
    folder_for(out)
    if world not in SIMULATED_WORLDS:
        raise UserError(f"--world {world}: valid are {' and '.join(SIMULATED_WORLDS)}")
    console = sentences()
    name = f"probe_{world}"
    rows = rows_in(out, name, f"probe, {world}, seed {seed}", resume=resume)
    cases = wrongly_believed(seed, updates)
    with counting(console) as bar:
        ready = sum(row.run == BEFORE for row in rows.rows)
        task = bar.add_task("updates", total=len(cases), completed=ready)
        for row in run_probes(cases, world, jobs=jobs, done=rows.done):
            rows.add(row)
            if row.run == BEFORE:
                bar.advance(task)
    wanted = {f"{hidden} {number}" for hidden, number in cases}
    asked = [row for row in rows.rows if row.case in wanted]
    said, comparison = verdict(asked), compared(asked)
    notes = [
        said,
        f"World: {world}. Seeds: from {seed}. Force threshold: {FORCE_THRESHOLD_N} N. An update is "
        "asked for in warning state 1 or 2 of the local metric; seeds that end without a warning "
        "are left out.",
        "before: what the chain makes of the shapes up to the warning. tug: after the tug that "
        "parts the explanations most. goes on: after as much of the planned motion instead, as "
        "slowly and for as long. Cases count where both can be told.",
        "Doubtful holes are those after the first estimate. back: the discrepancy is under its "
        "first threshold. Surface: median distance of the actual upper face from the twin's, where "
        "the motion led, and, the same place for all, at the end of the whole plan. Computing: of "
        "the estimate; choosing a tug comes on top (choosing_s).",
        "Differences are means with 95 % intervals from a bootstrap over cases; better: on which "
        f"side the interval leaves out 0, where {LEAST_PAIRS} cases or more differ.",
    ]
    tables = {
        "How often": frequencies(asked),
        "Cases with a tug": comparison,
        "Updates": run_rows(asked),
    }
    write_benchmark(out, name, "Tugging to learn", tables, notes)
    shown_on = Console() if Console().is_terminal else Console(width=200)
    for lines in (tables["How often"], comparison):
        # Medians are in the files: there are more numbers than a terminal is wide.
        keys = [key for key in lines[0] if not key.endswith("median")]
        shown = Table(*(escape(key) for key in keys), box=None)
        for line in lines:
            shown.add_row(*(escape(_short(line[key])) for key in keys))
        shown_on.print(shown)
    typer.echo(said)
    typer.echo(f"Written to {out}: {name}.json, {name}.csv, {name}.html")


def _short(value: object) -> str:
    return "-" if value is None else str(value)
