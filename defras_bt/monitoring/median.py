"""The paper's metric: the median nearest-neighbour distance of two clouds."""

from __future__ import annotations

import numpy as np

from defras_bt.monitoring.metric import Measurement
from defras_bt.monitoring.neighbours import nearest_m
from defras_bt.monitoring.seen import SeenSurface
from defras_sim.geometry import Floats


class MedianMetric:
    """Median over the observed points of the distance to the nearest simulated point.

    The simulated points are fixed places of the visible surface, so the metric has a floor of
    about half their spacing, which the rest value takes away. It sees what shifts everything a
    little and misses what moves less than half of the tissue, however far.

    Tagliabue et al. 2022. The printed listing writes a norm; the text says median.
    """

    name = "median"

    def measure(self, cloud_m: Floats, seen: SeenSurface) -> Measurement:
        if len(cloud_m) == 0 or len(seen.samples_m) == 0:
            return Measurement(float("nan"), lambda: np.full(len(cloud_m), np.nan))
        distance_m = nearest_m(np.ascontiguousarray(cloud_m), seen.samples_m)
        return Measurement(float(np.median(distance_m)), lambda: distance_m)
