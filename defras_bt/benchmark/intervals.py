"""Shares, medians and paired differences with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

_CONFIDENCE = 0.95
_TAILS = (0.025, 0.975)
_DRAWS = 2000

LEAST_PAIRS = 6
"""Fewer pairs that differ say nothing, even where all agree: by a sign test five of five have a
chance of 6 %."""


def share(true: Sequence[bool]) -> str:
    """In per cent, with the exact 95 % interval (Clopper and Pearson)."""
    if not true:
        return "-"
    found = binomtest(sum(true), len(true)).proportion_ci(_CONFIDENCE)
    return f"{100 * np.mean(true):.0f} ({100 * found.low:.0f} to {100 * found.high:.0f})"


def median(values: Sequence[float | None]) -> str:
    """With a 95 % interval from a bootstrap over updates."""
    known = np.array([value for value in values if value is not None])
    if len(known) == 0:
        return "-"
    rng = np.random.default_rng(0)
    drawn = np.median(rng.choice(known, size=(_DRAWS, len(known))), axis=1)
    low, high = np.quantile(drawn, _TAILS)
    return f"{np.median(known):.2f} ({low:.2f} to {high:.2f})"


@dataclass(frozen=True)
class Difference:
    """Mean of ``pairs`` paired differences with a 95 % interval from a bootstrap over pairs; NaN
    without pairs. ``differing`` of them are not 0."""

    pairs: int
    differing: int
    mean: float
    low: float
    high: float

    @staticmethod
    def of(differences: Sequence[float]) -> Difference:
        if not differences:
            return Difference(0, 0, np.nan, np.nan, np.nan)
        known = np.array(differences, float)
        rng = np.random.default_rng(0)
        drawn = rng.choice(known, size=(_DRAWS, len(known))).mean(axis=1)
        low, high = np.quantile(drawn, _TAILS)
        differing = int(np.count_nonzero(known))
        return Difference(len(known), differing, float(known.mean()), float(low), float(high))

    @property
    def sign(self) -> int:
        """1 or -1 where the interval leaves out 0 and enough pairs differ; else 0."""
        if self.differing < LEAST_PAIRS:
            return 0
        return int(self.low > 0) - int(self.high < 0)

    def __str__(self) -> str:
        if not self.pairs:
            return "-"
        return f"{self.mean:+.3f} ({self.low:+.3f} to {self.high:+.3f})"
