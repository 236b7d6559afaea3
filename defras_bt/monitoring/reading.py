"""What monitoring says at one tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from defras_sim.geometry import Floats


def nowhere() -> Floats:
    """The distances (0,) of no cloud."""
    return np.zeros(0)


@dataclass(frozen=True)
class MonitorReading:
    """Discrepancy between the observed cloud and the twin's surface.

    ``mu_m`` per metric ("local", "median"), with the rest value subtracted, never below 0; NaN
    while it cannot be said. ``warning_state`` per metric, 0..3. Both are of the cloud stamped
    ``stamp_s``, those of a metric that could wait maybe of a cloud before it. ``distances`` makes
    :attr:`per_point_m`, when somebody wants it.
    """

    stamp_s: float
    mu_m: Mapping[str, float]
    warning_state: Mapping[str, int]
    distances: Callable[[], Floats] = field(default=nowhere, repr=False, compare=False)

    @cached_property
    def per_point_m(self) -> Floats:
        """The local metric's distance at each cloud point (n,), for pictures."""
        return self.distances()
