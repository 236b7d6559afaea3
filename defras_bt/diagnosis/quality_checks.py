"""Checks of rows of measured data, each one trap that real files hold."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.quality import Mask
from defras_sim.geometry import Floats

# A pause this many usual periods long is a drop-out.
DROP_OUT_PERIODS = 4.0


def unfinite_rows(values: Floats) -> Mask:
    """Rows (n,) of ``values`` (n, columns) with a number that is none."""
    return np.asarray(~np.isfinite(values).all(axis=1), bool)


def zero_rows(values: Floats) -> Mask:
    """Rows (n,) that are zero throughout: what many drivers write where nothing was seen.

    A column that stands at zero all the time says nothing; where all do, no row is marked.
    """
    alive = np.any(values != 0.0, axis=0)
    if not alive.any():
        return np.zeros(len(values), bool)
    return np.asarray((values[:, alive] == 0.0).all(axis=1), bool)


def backward_rows(time_s: Floats) -> Mask:
    """Rows (n,) that are not later than one before them, or have no time at all.

    A single time far ahead of those after it is the row at fault, not all that follow: of two
    readings the one that fewer rows contradict is taken.
    """
    time_s = np.asarray(time_s, float)
    finite = np.isfinite(time_s)
    bad = ~finite
    times = time_s[finite]
    chain = _longest_rising(times)
    rising = np.zeros(len(times), bool)
    rising[chain] = True
    bad[finite] = ~rising
    return bad


def _longest_rising(times: Floats) -> list[int]:
    """Indices of a longest strictly rising run of values (patience sorting)."""
    ends: list[int] = []
    tails: list[float] = []
    before = np.full(len(times), -1)
    for i, t in enumerate(times):
        at = int(np.searchsorted(tails, t, side="left"))
        before[i] = ends[at - 1] if at else -1
        if at == len(ends):
            ends.append(i)
            tails.append(float(t))
        else:
            ends[at], tails[at] = i, float(t)
    chain: list[int] = []
    here = ends[-1] if ends else -1
    while here >= 0:
        chain.append(here)
        here = int(before[here])
    return chain[::-1]


def pauses_s(time_s: Floats, periods: float = DROP_OUT_PERIODS) -> list[tuple[float, float]]:
    """Start and end of every pause between rising times (n,) that is long for this source."""
    if len(time_s) < 3:
        return []
    steps = np.diff(time_s)
    long = np.flatnonzero(steps > periods * float(np.median(steps)))
    return [(float(time_s[i]), float(time_s[i + 1])) for i in long]


def repeated_rows(values: Floats) -> Mask:
    """Rows (n,) equal to the one before in every bit: a reading that was sent twice."""
    same = np.zeros(len(values), bool)
    same[1:] = (values[1:] == values[:-1]).all(axis=1)
    return same


def spike_rows(position: Floats, far: float, among: Mask) -> Mask:
    """Single rows (n,) of ``among`` farther than ``far`` from both neighbours that agree."""
    rows = np.flatnonzero(among)
    marked = np.zeros(len(position), bool)
    if len(rows) < 3:
        return marked
    p = position[rows]
    before, here, after = p[:-2], p[1:-1], p[2:]
    away = np.minimum(np.linalg.norm(here - before, axis=1), np.linalg.norm(here - after, axis=1))
    apart = np.linalg.norm(after - before, axis=1)
    marked[rows[1:-1]] = (away > far) & (apart < 0.5 * away)
    return marked
