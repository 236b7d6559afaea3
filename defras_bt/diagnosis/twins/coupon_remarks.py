"""What holds of specimens say about viscosity, whatever its elastic law.

Stress that relaxes linearly, and quasi-linearly too, fades by the same share at every stretch. To
compare holds at different stretches, time counts from the middle of the stretching that led to
each, and begins when several times the longest stretching has passed: how long the stretching took
then makes no difference any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

_WAITS = 5.0
"""Times the longest stretching; a shift of time by half of it is then second order."""
_SPAN = 3.0
"""A hold should last this many times as long as what is waited for."""
_AROUND = 0.05
"""Readings this share of a time before and after it are averaged."""
_NOTICEABLE = 0.03
"""Difference of shares that is more than how specimens are mounted explains."""


@dataclass(frozen=True)
class Hold:
    """The end of one run. ``since_s`` (n,): time since the middle of the stretching, which took
    ``stretching_s``; forces (n,) over it, measured and predicted."""

    stretch: float
    stretching_s: float
    since_s: Floats
    measured_n: Floats
    predicted_n: Floats


def last_hold(
    time_s: Floats,
    stretch: Floats,
    measured_n: Floats,
    predicted_n: Floats,
    held: NDArray[np.bool_],
) -> Hold | None:
    """The hold in which a run ends; None where it ends in something else. Rows (n,), ``held`` where
    the stretch stays."""
    moving = np.flatnonzero(~held)
    if not len(moving) or moving[-1] + 1 >= len(time_s):
        return None
    first, start = int(moving[0]), int(moving[-1]) + 1
    rows = np.arange(start, len(time_s))
    rows = rows[np.isfinite(measured_n[rows])]
    since_s = time_s[rows] - 0.5 * (time_s[first] + time_s[start])
    return Hold(
        float(np.median(stretch[start:])),
        float(time_s[start] - time_s[first]),
        since_s,
        measured_n[rows],
        predicted_n[rows],
    )


def linearity_remark(holds: Sequence[Hold]) -> str | None:
    """That relaxation depends on the stretch, if it does by more than the model says."""
    if len(holds) < 2:
        return None
    start_s = _WAITS * max(hold.stretching_s for hold in holds)
    long = [h for h in holds if len(h.since_s) and h.since_s[-1] >= _SPAN * start_s]
    if len(long) < 2:
        return None
    end_s = min(float(hold.since_s[-1]) for hold in long) / (1 + _AROUND)
    left = [_left(hold, hold.measured_n, start_s, end_s) for hold in long]
    said = [_left(hold, hold.predicted_n, start_s, end_s) for hold in long]
    least, most = int(np.nanargmin(left)), int(np.nanargmax(left))
    if (left[most] - left[least]) - (max(said) - min(said)) < _NOTICEABLE:
        return None
    return (
        "Linear viscoelasticity is not enough, nor is a quasi-linear one: of the force "
        f"{start_s:.0f} s into a hold, {100 * left[least]:.0f} % is left after {end_s:.0f} s at a "
        f"stretch of {long[least].stretch:.2f}, {100 * left[most]:.0f} % at "
        f"{long[most].stretch:.2f}; both laws have it the same at every stretch."
    )


def _left(hold: Hold, force_n: Floats, start_s: float, end_s: float) -> float:
    """Share of the force at ``start_s`` that is left at ``end_s``; NaN where none was read."""
    late, early = (force_n[np.abs(hold.since_s - at) <= _AROUND * at] for at in (end_s, start_s))
    return float(np.mean(late) / np.mean(early)) if len(late) and len(early) else np.nan
