"""What monitoring says at one tick."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class MonitorReading:
    """Discrepancy between the observed cloud and the twin's surface.

    ``mu_m`` per metric ("local", "median"), with the rest value subtracted, never below 0; NaN
    while it cannot be said. ``warning_state`` per metric, 0..3. Both are of the cloud stamped
    ``stamp_s``, those of a metric that could wait maybe of a cloud before it. ``per_point_m`` (n,)
    is the local metric's distance at each cloud point, for pictures.
    """

    stamp_s: float
    mu_m: Mapping[str, float]
    warning_state: Mapping[str, int]
    per_point_m: Floats = field(default_factory=lambda: np.zeros(0))
