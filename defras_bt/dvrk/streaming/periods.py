"""How regular a stream is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats

_BIN_S = 2e-5
_LONGEST_S = 2.0


@dataclass(frozen=True)
class PeriodReport:
    """Times between set-points in seconds; ``count`` of them."""

    nominal_s: float
    count: int
    median_s: float | None
    p99_s: float | None
    longest_s: float | None

    def values(self) -> Mapping[str, float | int | None]:
        return {
            "nominal_s": self.nominal_s,
            "count": self.count,
            "median_s": self.median_s,
            "p99_s": self.p99_s,
            "longest_s": self.longest_s,
        }


class Durations:
    """Counts durations in bins of 20 microseconds: a stream of hours takes no more memory."""

    def __init__(self) -> None:
        self._bins = np.zeros(round(_LONGEST_S / _BIN_S) + 1, np.int64)
        self._longest_s = 0.0
        self.count = 0

    def add(self, duration_s: float) -> None:
        """Longer than 2 s count as that, but for :attr:`longest_s`."""
        self._bins[min(max(round(duration_s / _BIN_S), 0), len(self._bins) - 1)] += 1
        self._longest_s = max(self._longest_s, duration_s)
        self.count += 1

    @property
    def longest_s(self) -> float | None:
        return self._longest_s if self.count else None

    def quantile_s(self, share: float) -> float | None:
        """The duration that ``share`` of all do not exceed; None where there are none."""
        if not self.count:
            return None
        sums: Floats = np.cumsum(self._bins)
        return float(np.searchsorted(sums, share * self.count)) * _BIN_S

    def report(self, nominal_s: float) -> PeriodReport:
        return PeriodReport(
            nominal_s, self.count, self.quantile_s(0.5), self.quantile_s(0.99), self.longest_s
        )
