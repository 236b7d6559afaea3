"""Tables of measured data: CSV whose headers carry the units.

A header is a name and a unit, ``q5_measured_rad`` or ``force_N``; millimetres, degrees and other
usual units are converted, so that columns have their SI names. Lines that start with ``#`` are
comments. A column ``trajectory`` tells runs of one file apart; without it a file is one run.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats
from defras_sim.yaml_source import Fault, InvalidFile

TRAJECTORY = "trajectory"

_SI: Mapping[str, tuple[str, float]] = {
    "s": ("s", 1.0), "ms": ("s", 1e-3), "min": ("s", 60.0),
    "m": ("m", 1.0), "mm": ("m", 1e-3), "m2": ("m2", 1.0), "mm2": ("m2", 1e-6),
    "rad": ("rad", 1.0), "deg": ("rad", np.pi / 180),
    "N": ("N", 1.0), "mN": ("N", 1e-3), "kN": ("N", 1e3),
    "Pa": ("Pa", 1.0), "kPa": ("Pa", 1e3), "MPa": ("Pa", 1e6),
}  # fmt: skip


@dataclass(frozen=True)
class Table:
    """One run: columns (rows,) by their SI names, NaN where a cell is empty, and each row's line
    (from 1) in the file."""

    file: Path
    name: str
    columns: Mapping[str, Floats]
    line: Integers

    def __len__(self) -> int:
        return len(self.line)

    def __getitem__(self, column: str) -> Floats:
        """A column.

        Raises:
            InvalidFile: the table has none of that name.
        """
        if column not in self.columns:
            close = get_close_matches(column, self.columns, n=1)
            hint = f"; is it {close[0]!r}?" if close else f"; it has: {', '.join(self.columns)}"
            raise self.fault(f"needs a column {column!r}{hint}")
        return self.columns[column]

    def fault(self, message: str) -> InvalidFile:
        """An error about the table as a whole."""
        return InvalidFile([Fault(self.file, 1, 1, message)])


def read_tables(file: Path) -> tuple[Table, ...]:
    """All runs of a file, in the order in which they begin.

    Raises:
        InvalidFile: the file cannot be read, has no rows, a header without a known unit, two
            columns of one name, or a cell that is no number: all faults at once.
    """
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            rows = list(_numbered(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InvalidFile([Fault(file, 1, 1, f"cannot be read as CSV: {error}")]) from error
    if len(rows) < 2:
        raise InvalidFile([Fault(file, 1, 1, "should hold a line of headers and lines of numbers")])
    (header_line, header), *body = rows
    faults: list[Fault] = []
    factors = _headers(file, header_line, header, faults)
    runs = [""] * len(body)
    values = np.full((len(body), len(header)), np.nan)
    for row, (line, cells) in enumerate(body):
        if len(cells) != len(header):
            message = f"has {len(cells)} cells where the header has {len(header)}"
            faults.append(Fault(file, line, 1, message))
            continue
        for column, cell in enumerate(cells):
            text = cell.strip()
            if header[column].strip() == TRAJECTORY:
                runs[row] = text
            elif text:
                try:
                    values[row, column] = float(text) * factors[column][1]
                except ValueError:
                    message = f"{header[column].strip()} should be a number, is {text!r}"
                    faults.append(Fault(file, line, column + 1, message))
    if faults:
        raise InvalidFile(faults)
    names = [name for name, _ in factors]
    keep = [i for i, name in enumerate(names) if name != TRAJECTORY]
    lines = np.array([line for line, _ in body], dtype=np.int64)
    tables = []
    for run in dict.fromkeys(runs):
        own = np.array([other == run for other in runs])
        columns = {names[i]: values[own, i] for i in keep}
        tables.append(Table(file, f"{file.stem}:{run}" if run else file.stem, columns, lines[own]))
    return tuple(tables)


def _numbered(stream: Iterator[str]) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and cells of all lines that are neither empty nor a comment."""
    for number, line in enumerate(stream, start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, next(csv.reader([line]))


def _headers(
    file: Path, line: int, header: Sequence[str], faults: list[Fault]
) -> list[tuple[str, float]]:
    """SI name of each column, and what its numbers are to be multiplied by."""
    found: list[tuple[str, float]] = []
    for column, cell in enumerate(header, start=1):
        name = cell.strip()
        stem, _, unit = name.rpartition("_")
        if stem and unit in _SI:
            si, factor = _SI[unit]
            name = f"{stem}_{si}"
        elif name in (TRAJECTORY, "stretch", "step"):
            factor = 1.0
        else:
            message = (
                f"header {name!r} should end with a unit, as time_s, q5_measured_rad or force_N; "
                f"units are {', '.join(_SI)}"
            )
            faults.append(Fault(file, line, column, message))
            factor = 1.0
        if name in (known for known, _ in found):
            faults.append(Fault(file, line, column, f"there are two columns {name!r}"))
        found.append((name, factor))
    return found
