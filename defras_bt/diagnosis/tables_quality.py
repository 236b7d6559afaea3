"""Rows of a table that can be believed, and what was wrong with the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from defras_bt.diagnosis.quality import DataFault, DataQuality, Mask, Sieve
from defras_bt.diagnosis.quality_checks import DROP_OUT_PERIODS, backward_rows, unfinite_rows
from defras_bt.diagnosis.tables import Table
from defras_sim.geometry import Floats

_USUAL_ZEROS = 0.05
"""A column that is zero more often than this says nothing by being zero."""

_AROUND = 5
"""Steps before and after one that say what is usual there."""


def rows_in_time(table: Table) -> tuple[Mask, list[DataFault]]:
    """Rows (n,) whose time can be believed, and what is wrong with the rest.

    A table without ``time_s`` is taken in the order of its rows.
    """
    time_s = table.columns.get("time_s", np.arange(len(table), dtype=float))
    sieve = Sieve(table.name, time_s)
    sieve.leave_out(~np.isfinite(time_s), "not_finite", "time is no number")
    sieve.leave_out(backward_rows(time_s), "time_backwards", "time repeats or runs backwards")
    gaps = _drop_outs_s(time_s[sieve.kept])
    if gaps:
        longest = max(b - a for a, b in gaps)
        sieve.report(
            "drop_out", gaps, f"{_times(len(gaps))} without rows, the longest for {longest:.2f} s"
        )
    return sieve.kept, sieve.faults


def measured_rows(
    table: Table, source: str, columns: Sequence[str], among: Mask
) -> tuple[Mask, list[DataFault]]:
    """Rows (n,) of ``among`` in which all of ``columns`` were really measured.

    ``source`` is what a reader calls these columns together, as "measured joints".
    """
    values = np.stack([table[column] for column in columns], axis=1)
    time_s = table.columns.get("time_s", np.arange(len(table), dtype=float))
    sieve = Sieve(f"{table.name} {source}", time_s)
    sieve.kept = among.copy()
    sieve.leave_out(unfinite_rows(values), "not_finite", "not every reading is a number")
    sieve.leave_out(_zeros_at_once(values), "zeros", "several readings are exactly zero at once")
    return sieve.kept, sieve.faults


def suspected_unit(
    table: Table, column: str, limit: float, suspicion: str
) -> tuple[bool, list[DataFault]]:
    """Whether numbers of ``column`` are too large for its unit (its median beyond ``limit``)."""
    values = table[column]
    finite = np.abs(values[np.isfinite(values)])
    # A few wild readings are no other unit.
    if not len(finite) or np.quantile(finite, 0.9) <= limit:
        return False, []
    time_s = table.columns.get("time_s", np.arange(len(table), dtype=float))
    fault = DataFault(
        f"{table.name} {column}",
        "unit",
        ((float(np.nanmin(time_s)), float(np.nanmax(time_s))),),
        len(table),
        f"up to {finite.max():.4g}, more than {limit:.4g}: {suspicion}",
    )
    return True, [fault]


def _zeros_at_once(values: Floats) -> Mask:
    """Rows (n,) in which two or more columns are exactly zero that hardly ever are.

    A camera that saw a part of its markers writes zeros for that part only. Of one column alone a
    zero may be a reading.
    """
    zero = values == 0.0
    unusual = zero.mean(axis=0) < _USUAL_ZEROS
    return np.asarray((zero & unusual).sum(axis=1) >= 2, bool)


def _drop_outs_s(time_s: Floats) -> list[tuple[float, float]]:
    """Start and end of every step in time that is long beside those before and after it.

    Rows need not come evenly: many are written where much happens, few in a long hold.
    """
    steps = np.diff(time_s)
    if len(steps) < 3:
        return []
    around = np.lib.stride_tricks.sliding_window_view(
        np.pad(steps, _AROUND, "reflect"), 2 * _AROUND + 1
    )
    long = np.flatnonzero(steps > DROP_OUT_PERIODS * np.median(around, axis=1))
    return [(float(time_s[i]), float(time_s[i + 1])) for i in long]


def quality(tables: Sequence[Table], faults: Sequence[DataFault]) -> DataQuality:
    """What was read and what was wrong with it."""
    rows: Mapping[str, int] = {table.name: len(table) for table in tables}
    return DataQuality(rows, tuple(faults))


def scatter(values: Floats) -> float:
    """Standard deviation of what changes from row to row at random, in a smooth series (n,).

    From second differences, by their median, which jumps do not move. 0 below five rows.
    """
    if len(values) < 5:
        return 0.0
    second = np.diff(values, n=2)
    # The median of |normal| is 0.6745 of its standard deviation; second differences have sqrt 6.
    return float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6.0))


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
