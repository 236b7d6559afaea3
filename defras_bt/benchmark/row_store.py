"""Rows of a long benchmark on disk, one JSON object a line, as soon as each is there."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from defras_bt.benchmark.retraction import Row


class OtherBenchmark(ValueError):
    """The rows on disk answer another question."""


class RowStore:
    """``question`` says what was asked (world, seed, ...): rows of another one are not mixed in.

    Raises:
        OtherBenchmark: with ``resume``, if the file's rows are of another question.
    """

    def __init__(self, file: Path, question: str, *, resume: bool) -> None:
        self._file = file
        self.rows: list[Row] = []
        if resume and file.exists():
            lines = file.read_text(encoding="utf-8").split("\n")[:-1]  # the last may be cut short
            asked = json.loads(lines[0])["question"] if lines else question
            if asked != question:
                raise OtherBenchmark(
                    f"{file} holds rows of {asked!r}; this is {question!r}: start without --resume"
                )
            self.rows = [Row(**json.loads(line)) for line in lines[1:]]
        header = json.dumps({"question": question})
        kept = [json.dumps(asdict(row)) for row in self.rows]
        file.write_text("\n".join([header, *kept]) + "\n", encoding="utf-8")

    @property
    def done(self) -> frozenset[str]:
        return frozenset(row.key for row in self.rows)

    def add(self, row: Row) -> None:
        self.rows.append(row)
        with self._file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(row)) + "\n")

    def discard(self) -> None:
        """The results were written in full; the rows are not needed any more."""
        self._file.unlink(missing_ok=True)
