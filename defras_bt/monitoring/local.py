"""The worst smoothed neighbourhood of the point-to-surface distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.monitoring.closest import checked, distance_to_triangles_m
from defras_bt.monitoring.metric import Measurement
from defras_bt.monitoring.seen import SeenSurface
from defras_bt.monitoring.worst_neighbourhood import worst_median_m
from defras_sim.geometry import Floats


@dataclass(frozen=True)
class LocalMetric:
    """Distance of each point to the visible simulated surface, smoothed; the worst counts.

    A point's smoothed distance is the median over its neighbourhood, a ball of ``diameter_m``:
    up to half of the neighbours may be outliers, such as a few points on an instrument or at the
    rim of an occlusion. Points with fewer than ``min_neighbours`` (themselves included) say
    nothing; if most points are like that, the value is NaN, for a cloud so thin hides mismatch.

    The opposite direction, simulated surface without observed points near it, is left out on
    purpose: only what the twin holds for visible is compared, so tissue missing where the twin
    has some uncovers points, in the same line of sight, that the twin holds for hidden, and those
    are far from anything visible. What it would add are false alarms behind instruments.
    """

    diameter_m: float = 0.015
    min_neighbours: int = 5
    max_neighbours: int = 24
    name: str = "local"

    def measure(self, cloud_m: Floats, seen: SeenSurface) -> Measurement:
        distances = _Distances(cloud_m, seen.corners_m)
        if len(cloud_m) < self.min_neighbours or len(seen.corners_m) == 0:
            return Measurement(float("nan"), distances)
        worst_m, known = worst_median_m(
            *checked(cloud_m, seen.corners_m),
            self.diameter_m / 2,
            self.min_neighbours,
            self.max_neighbours,
        )
        return Measurement(worst_m if 2 * known > len(cloud_m) else float("nan"), distances)


@dataclass(frozen=True)
class _Distances:
    """Distances (n,) of a cloud to triangles; NaN where there are none of these."""

    cloud_m: Floats
    corners_m: Floats

    def __call__(self) -> Floats:
        if len(self.corners_m) == 0:
            return np.full(len(self.cloud_m), np.nan)
        return distance_to_triangles_m(self.cloud_m, self.corners_m)
