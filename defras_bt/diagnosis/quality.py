"""What is wrong with measured data: found, reported with its times, left out, counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Mask = NDArray[np.bool_]

FaultKind = Literal[
    "zeros",
    "not_finite",
    "time_backwards",
    "drop_out",
    "clock_offset",
    "unit",
    "frozen",
    "outlier",
    "missing",
]

_SPANS_SHOWN = 4


@dataclass(frozen=True)
class DataFault:
    """One kind of fault of one source (a topic, a column).

    ``spans_s``: first and last time of each stretch of rows. ``rows`` were left out for it; 0 where
    nothing was, as for a gap between rows.
    """

    source: str
    kind: FaultKind
    spans_s: tuple[tuple[float, float], ...]
    rows: int
    what: str

    @property
    def sentence(self) -> str:
        """What was found, when, and what became of it."""
        shown = ", ".join(_span(span) for span in self.spans_s[:_SPANS_SHOWN])
        more = len(self.spans_s) - _SPANS_SHOWN
        when = f" at {shown}" + (f" and {more} more times" if more > 0 else "")
        rows = f"; {self.rows} row{'s'[: self.rows != 1]} left out" if self.rows else ""
        return f"{self.source}: {self.what}{when if shown else ''}{rows}"


@dataclass(frozen=True)
class DataQuality:
    """Rows read by source, and everything found wrong with them."""

    rows: Mapping[str, int]
    faults: tuple[DataFault, ...] = ()

    @property
    def left_out(self) -> Mapping[str, int]:
        """Rows left out by source; sources without any are not listed."""
        count: Counter[str] = Counter()
        for fault in self.faults:
            count[fault.source] += fault.rows
        return {source: rows for source, rows in count.items() if rows}

    @staticmethod
    def together(parts: Mapping[str, DataQuality]) -> DataQuality:
        """That of several files, each source with the name of its file in front."""
        if len(parts) == 1:
            return next(iter(parts.values()))
        rows = {f"{file}:{s}": n for file, part in parts.items() for s, n in part.rows.items()}
        faults = (
            DataFault(f"{file}:{f.source}", f.kind, f.spans_s, f.rows, f.what)
            for file, part in parts.items()
            for f in part.faults
        )
        return DataQuality(rows, tuple(faults))

    def as_data(self) -> dict[str, object]:
        """The ``data_quality`` of verdict.json."""
        return {
            "rows": dict(self.rows),
            "left_out": dict(self.left_out),
            "faults": [
                {
                    "source": fault.source,
                    "kind": fault.kind,
                    "spans_s": [[round(a, 6), round(b, 6)] for a, b in fault.spans_s],
                    "rows": fault.rows,
                    "sentence": fault.sentence,
                }
                for fault in self.faults
            ],
        }


class Sieve:
    """Rows of one source on their way through checks; what one check takes the next never sees."""

    def __init__(self, source: str, time_s: Floats) -> None:
        self.source = source
        self._time_s = np.asarray(time_s, float)
        self.kept: Mask = np.ones(len(self._time_s), bool)
        self.faults: list[DataFault] = []

    def leave_out(self, bad: Mask, kind: FaultKind, what: str) -> None:
        """Take the rows ``bad`` (rows,) that are still there."""
        taken = np.asarray(bad, bool) & self.kept
        if taken.any():
            spans = _spans_s(taken, self._time_s)
            self.faults.append(DataFault(self.source, kind, spans, int(taken.sum()), what))
            self.kept = self.kept & ~taken

    def report(self, kind: FaultKind, spans_s: Iterable[tuple[float, float]], what: str) -> None:
        """Something that takes no row away."""
        self.faults.append(DataFault(self.source, kind, tuple(spans_s), 0, what))


def _spans_s(marked: Mask, time_s: Floats) -> tuple[tuple[float, float], ...]:
    """First and last time of every run of marked rows; rows without a time have the one before."""
    known = np.where(np.isfinite(time_s), time_s, -np.inf)
    known = np.maximum.accumulate(known)
    known = np.where(np.isfinite(known), known, 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return tuple(
        (float(known[a]), float(known[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)
    )


def _span(span_s: tuple[float, float]) -> str:
    first, last = span_s
    return f"{first:.2f} s" if last - first < 0.005 else f"{first:.2f} to {last:.2f} s"
