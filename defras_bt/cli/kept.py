"""What a benchmark keeps in its folder to go on from."""

from __future__ import annotations

from pathlib import Path

from defras_bt.benchmark.row_store import OtherBenchmark, RowStore
from defras_bt.cli.errors import UserError
from defras_bt.planning.journal import InvalidJournal, Journal


def rows_in(out: Path, name: str, question: str, *, resume: bool) -> RowStore:
    """Rows of benchmark ``name`` in folder ``out``, the answers to ``question``.

    Raises:
        UserError: with ``resume``, the rows there are of another question.
    """
    try:
        return RowStore(out / f"{name}.rows.jsonl", question, resume=resume)
    except OtherBenchmark as error:
        raise UserError(str(error)) from error


def rehearsals_in(out: Path) -> Journal:
    """Rehearsals already made in folder ``out``.

    Raises:
        UserError: the file there is none of rehearsals.
    """
    try:
        return Journal(out / "rehearsals.journal")
    except InvalidJournal as error:
        raise UserError(str(error)) from error
