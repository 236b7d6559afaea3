"""What the sensors of a retraction scatter, from the frames in which nothing else happens."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_sim.geometry import Floats

_FEW_FRAMES = 8
_BORROWED = 10.0
"""Independent frames that the other rows of its kind are worth to a row."""
_MOST_ALIKE = 0.95
"""Correlation of neighbouring frames that is believed at most: from a second of rest, no more can
be told from drift."""


def noise_sd(
    residual: Sequence[Floats], phases: Sequence[Integers], rows_alike: Integers
) -> Floats:
    """What each row (rows,) of the residuals (rows, frames) scatters by itself.

    From the frames before anything was grasped, where only the sensor changes; where those are few,
    from how much neighbouring frames differ. Errors of a camera remember, so that a short rest sees
    less of them than there is: what the mean of so few independent frames took along is given back
    (Bartlett 1946), and rows of one kind (``rows_alike``, by number) lend each other what they
    know. A row that was never seen gets the middle of its kind.
    """
    squares = np.full((len(rows_alike), len(residual)), np.nan)
    worth = np.zeros_like(squares)
    for index, (each, phase) in enumerate(zip(residual, phases, strict=True)):
        rest = each[:, phase == PHASES.index("rest")]
        at_rest = np.isfinite(rest).sum(axis=1) >= _FEW_FRAMES
        squares[:, index] = _spread(np.diff(each, axis=1) / np.sqrt(2.0)) ** 2
        worth[:, index] = np.isfinite(each).sum(axis=1)
        for kind in np.unique(rows_alike):
            mine = at_rest & (rows_alike == kind)
            if mine.any():
                count = _independent(rest[mine])
                squares[mine, index] = _spread(rest[mine] - _middle(rest[mine])) ** 2
                squares[mine, index] *= count / (count - 1.0)
                worth[mine, index] = count
    known = np.isfinite(squares)
    frames = np.where(known, worth, 0.0).sum(axis=1)
    own = np.where(known, squares * worth, 0.0).sum(axis=1) / np.maximum(frames, 1e-12)
    found = np.zeros(len(own))
    for kind in np.unique(rows_alike):
        mine = rows_alike == kind
        seen = own[mine & (frames > 0) & (own > 0)]
        typical = float(np.median(seen)) if len(seen) else 0.0
        found[mine] = frames[mine] * own[mine] + _BORROWED * typical
        found[mine] /= frames[mine] + _BORROWED
    return np.asarray(np.sqrt(found))


def _independent(rest: Floats) -> float:
    """How many independent frames the frames of ``rest`` (rows, frames) are worth, above 1.5: from
    the correlation of neighbours, all rows together."""
    away = rest - np.nanmean(rest, axis=1, keepdims=True)
    both = np.isfinite(away[:, 1:]) & np.isfinite(away[:, :-1])
    together = float(np.sum(np.where(both, away[:, 1:] * away[:, :-1], 0.0)))
    alone = 0.5 * float(np.sum(np.where(both, away[:, 1:] ** 2 + away[:, :-1] ** 2, 0.0)))
    count = rest.shape[1]
    seen = together / alone if alone > 0.0 else 0.0
    # The mean that was taken off makes neighbours look less alike (Marriott and Pope 1954).
    alike = float(np.clip((seen + 1.0 / count) / (1.0 - 4.0 / count), 0.0, _MOST_ALIKE))
    lags = np.arange(1, count)
    longer = 1.0 + 2.0 * float(np.sum((1.0 - lags / count) * alike**lags))
    return max(count / longer, 1.5)


def _middle(values: Floats) -> Floats:
    """Median (rows, 1) of the finite values of each row, NaN where there are none."""
    found = np.full((len(values), 1), np.nan)
    some = np.isfinite(values).any(axis=1)
    found[some, 0] = np.nanmedian(values[some], axis=1)
    return found


def _spread(values: Floats) -> Floats:
    """Robust standard deviation (rows,) about zero, from the median of magnitudes."""
    return 1.4826 * _middle(np.abs(values))[:, 0]
