"""``defras benchmark diagnosis``: causes are hidden in data, and have to be found."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, get_args

import typer
from rich.console import Console
from rich.table import Table

from defras_bt.benchmark.diagnosis_boards import boards, in_words
from defras_bt.benchmark.diagnosis_cases import CAUSES, BoardCase, board_cases
from defras_bt.benchmark.diagnosis_runs import GRASPS, BoardRow, board_rows
from defras_bt.benchmark.files import write_benchmark
from defras_bt.cli.errors import UserError
from defras_bt.cli.files import folder_for
from defras_bt.cli.progress import counting, sentences
from defras_sim.effects.effect import TwinName


def diagnosis(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/benchmark"),
    quick: Annotated[
        bool,
        typer.Option(help="Few runs, one retraction each, of every third cause: twenty minutes."),
    ] = False,
    twins: Annotated[str, typer.Option(help="Separated by commas.")] = "coupon,arm,tissue",
    seeds: Annotated[int | None, typer.Option(min=0, help="Runs of every cause.")] = None,
    nulls: Annotated[int | None, typer.Option(min=0, help="Runs without any cause.")] = None,
    lacking: Annotated[
        int | None, typer.Option(min=0, help="Runs of every cause with it taken from the library.")
    ] = None,
    pairs: Annotated[int | None, typer.Option(min=0, help="Runs with two causes.")] = None,
    only: Annotated[
        str | None, typer.Option(help="Of the causes only these, separated by commas.")
    ] = None,
    grasps: Annotated[
        int,
        typer.Option(
            min=1,
            max=len(GRASPS),
            help="Retractions at so many grasp points are diagnosed together.",
        ),
    ] = 1,
    first_seed: Annotated[int, typer.Option(min=0)] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Runs side by side.")] = 2,
    resume: Annotated[bool, typer.Option(help="Go on with the rows in the folder.")] = False,
) -> None:
    """How often a hidden cause is named, how often where there is none, and what naming it gains.

    Data are made with another mesh, element, time step and noise than the model that diagnoses.
    Textbook approaches are asked of the same data. Ctrl-C keeps the rows for --resume.

    Example: defras benchmark diagnosis --quick --out out/benchmark
    """
    asked: list[TwinName] = []
    for name in twins.split(","):
        if name not in get_args(TwinName):
            raise UserError(f"--twins {name}: valid are {', '.join(get_args(TwinName))}")
        asked += [twin for twin in get_args(TwinName) if twin == name]
    if grasps > 1 and "tissue" not in asked:
        raise UserError(f"--grasps {grasps}: only tissue is grasped; --twins names {twins}")
    counts = (seeds, nulls, lacking, pairs)
    cases = [case for twin in asked for case in _cases(twin, quick, counts, first_seed)]
    if only is not None:
        cases = _only(cases, only.split(","))
    elif quick and seeds is None:
        cases = a_third(cases, first_seed)
    folder_for(out)
    file = out / "diagnosis.rows.jsonl"
    question = {"quick": quick, "grasps": grasps}
    rows = _known(file, question) if resume else []
    done = {row.key for row in rows}
    left = [case for case in cases if case.key not in done]
    console = sentences()
    with (
        file.open("a" if rows else "w", encoding="utf-8") as stream,
        counting(console) as bar,
    ):
        if not rows:
            stream.write(json.dumps(question) + "\n")
        task = bar.add_task("runs", total=len(cases), completed=len(cases) - len(left))
        for row in board_rows(left, further=not quick, baselines=True, jobs=jobs, grasps=grasps):
            rows.append(row)
            stream.write(json.dumps(row.as_dict()) + "\n")
            stream.flush()
            bar.advance(task)
            said = ", ".join(row.named or row.alike) or "-"
            console.print(f"{row.key}: {row.error or row.verdict}, {said}", markup=False)
    wanted = {case.key for case in cases}
    tables = boards([row for row in rows if row.key in wanted])
    notes = [
        "Right: just what was hidden was named. Macro: the mean over causes. Intervals are those "
        "of 95 % (Clopper and Pearson). Removed: median share of the excess error, of what was "
        "named rightly, on data that was not fitted.",
        "Tissue has the default mesh in the model, and 16x16x1 times six quadratic tetrahedra in "
        "reality.",
    ]
    write_benchmark(out, "diagnosis", "What the diagnosis finds", tables, notes)
    file.unlink()
    asked_rows = [row for row in rows if row.key in wanted and not row.error]
    for head, table in tables.items():
        if head in ("Every case", "Failed"):
            continue
        twin = next((each for each in asked if head.endswith(f": {each}")), None)
        if head == "Score":
            Console().print(_turned(head, table))
        else:
            Console().print(_table(head, in_words(asked_rows, twin) if twin else table))
    typer.echo(f"Written to {out}: diagnosis.json, diagnosis.csv, diagnosis.html")


def _table(head: str, table: Sequence[Mapping[str, Any]]) -> Table:
    shown = Table(*map(str, table[0]), title=head)
    for line in table:
        shown.add_row(*map(str, line.values()))
    return shown


def _turned(head: str, table: Sequence[Mapping[str, Any]]) -> Table:
    """A column for each line: there are more measures than fit side by side."""
    first, *measures = table[0]
    shown = Table(first, *(str(line[first]) for line in table), title=head)
    for measure in measures:
        shown.add_row(measure, *(str(line[measure]) for line in table))
    return shown


def _cases(
    twin: TwinName, quick: bool, counts: Sequence[int | None], first_seed: int
) -> list[BoardCase]:
    """Those of ``counts`` (seeds, nulls, lacking, pairs); as many as usual where None is given."""
    usual = {
        # A run takes about 0.4 s of computing (coupon), 4 s (arm) and 85 s (tissue, one
        # retraction, with making the data).
        ("coupon", True): (10, 60, 2, 6),
        ("arm", True): (1, 10, 1, 2),
        ("tissue", True): (1, 2, 0, 0),
        ("coupon", False): (20, 200, 10, 30),
        ("arm", False): (10, 200, 5, 30),
        ("tissue", False): (5, 200, 3, 40),
    }[twin, quick]
    seeds, nulls, lacking, pairs = (
        number if given is None else given for number, given in zip(usual, counts, strict=True)
    )
    return board_cases(
        twin, seeds=seeds, nulls=nulls, lacking=lacking, pairs=pairs, first_seed=first_seed
    )


def a_third(cases: Sequence[BoardCase], first_seed: int) -> list[BoardCase]:
    """Of causes hidden in retractions every third one, which the next two first seeds have not: all
    of them take half an hour on two cores, and so the whole takes less than twenty minutes."""
    own = CAUSES["tissue"][first_seed % 3 :: 3]
    return [
        case
        for case in cases
        if (case.twin, case.board) != ("tissue", "one") or case.causes[0] in own
    ]


def _only(cases: Sequence[BoardCase], wanted: Sequence[str]) -> list[BoardCase]:
    """Cases that hide something of ``wanted``: keys, or effects at any site.

    Raises:
        UserError: one of them is hidden in none.
    """

    def names(case: BoardCase) -> set[str]:
        return {name for cause in case.causes for name in (cause, cause.split("@")[0])}

    known = sorted({name for case in cases for name in names(case)})
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise UserError(f"--only {unknown[0]}: hidden are {', '.join(known)}")
    return [case for case in cases if names(case) & set(wanted)]


def _known(file: Path, question: Mapping[str, Any]) -> list[BoardRow]:
    """Rows of an interrupted benchmark; the last may be cut short.

    Raises:
        UserError: they answer another question.
    """
    if not file.exists():
        return []
    lines = file.read_text(encoding="utf-8").split("\n")[:-1]
    if not lines or json.loads(lines[0]) != question:
        raise UserError(f"{file} holds rows of another benchmark; start without --resume")
    return [BoardRow(**json.loads(line)) for line in lines[1:]]
