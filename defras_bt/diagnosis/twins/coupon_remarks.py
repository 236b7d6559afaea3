"""What holds of a specimen say about viscosity, whatever its elastic law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats

_LONG_HOLD = 0.5
"""Of a run's time: with less the force is still on its way."""
_AT_ENDS = 0.01
"""Of the rows of a hold: at its start and at its end these are averaged."""
_NOTICEABLE = 0.03
"""Difference of two such shares that does not come of how a specimen is mounted."""


@dataclass(frozen=True)
class Hold:
    """What is left of the force at the end of a hold, as a share of the force at its start."""

    stretch: float
    measured: float
    predicted: float


def last_hold(
    stretch: Floats, force_n: Floats, predicted_n: Floats, held: np.ndarray, time_s: Floats
) -> Hold | None:
    """That of a run which ends in a long one; rows (n,), ``held`` where the stretch stays."""
    moving = np.flatnonzero(~held)
    start = int(moving[-1]) + 1 if len(moving) else 0
    rows = np.arange(start, len(time_s))
    rows = rows[np.isfinite(force_n[rows])]
    if len(rows) < 10 or time_s[-1] - time_s[start] < _LONG_HOLD * (time_s[-1] - time_s[0]):
        return None
    ends = max(1, round(_AT_ENDS * len(rows)))
    measured, predicted = (
        float(np.mean(force[rows[-ends:]]) / np.mean(force[rows[:ends]]))
        for force in (force_n, predicted_n)
    )
    return Hold(float(np.median(stretch[rows])), measured, predicted)


def linearity_remark(holds: Sequence[Hold]) -> str | None:
    """Whether the share that is left differs with the stretch by more than the model says.

    Stress that relaxes linearly, and quasi-linearly too, keeps the same share at every stretch, but
    for how long the stretching took, which the model knows.
    """
    if len(holds) < 2:
        return None
    least, most = (pick(holds, key=lambda hold: hold.measured) for pick in (min, max))
    unexplained = (most.measured - least.measured) - abs(most.predicted - least.predicted)
    if unexplained < _NOTICEABLE:
        return None
    said = sorted(hold.predicted for hold in holds)
    return (
        f"Linear viscoelasticity is not enough: what is left of the force after the hold runs from "
        f"{least.measured:.2f} (at a stretch of {least.stretch:.2f}) to {most.measured:.2f} (at "
        f"{most.stretch:.2f}), where a law whose relaxation does not depend on the stretch says "
        f"{said[0]:.2f} to {said[-1]:.2f}."
    )
