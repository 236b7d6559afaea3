"""RecordedRun: what was told to the arms and what was measured, cleaned, in the tissue frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.quality import DataQuality
from defras_sim.geometry import Floats
from defras_sim.recorded_motion import RecordedMotion
from defras_sim.worlds.protocol import PointCloud


@dataclass(frozen=True)
class Readings:
    """Values (n, columns) at increasing times (n,)."""

    time_s: Floats
    values: Floats

    def at(self, time_s: Floats, within_s: float) -> Floats:
        """Values (m, columns) at other times (m,), linearly between readings.

        NaN where the readings on both sides are farther apart than ``within_s``, or one is missing.
        """
        count, columns = len(time_s), self.values.shape[1]
        if len(self.time_s) == 0:
            return np.full((count, columns), np.nan)
        after = np.clip(np.searchsorted(self.time_s, time_s), 1, max(1, len(self.time_s) - 1))
        before = after - 1
        after = np.minimum(after, len(self.time_s) - 1)
        known = (
            (time_s >= self.time_s[0])
            & (time_s <= self.time_s[-1])
            & (self.time_s[after] - self.time_s[before] <= within_s)
        )
        found = np.stack(
            [np.interp(time_s, self.time_s, self.values[:, k]) for k in range(columns)], axis=1
        )
        found[~known] = np.nan
        return found

    def mean_around(self, time_s: Floats, half_s: float) -> Floats:
        """Mean (m, columns) of the readings within ``half_s`` of each time (m,); NaN without any.

        Takes less noise along than the reading nearest in time.
        """
        first = np.searchsorted(self.time_s, time_s - half_s - 1e-9)
        last = np.searchsorted(self.time_s, time_s + half_s + 1e-9)
        sums = np.vstack([np.zeros(self.values.shape[1]), np.cumsum(self.values, axis=0)])
        count = (last - first)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.where(count > 0, (sums[last] - sums[first]) / count, np.nan))


@dataclass(frozen=True)
class RecordedRun:
    """One recording. Times are seconds since its first set-point.

    ``motion`` are the set-points and grips of all arms at common instants. By arm: ``measured_m``
    tips as the encoders say (3 columns), ``forces_n`` of the jaw on the tissue (3 columns) where a
    sensor was there, ``joints`` and ``setpoint_joints`` (6 columns). ``visibility`` has one column.
    """

    name: str
    motion: RecordedMotion
    clouds: tuple[PointCloud, ...]
    measured_m: Mapping[str, Readings]
    forces_n: Mapping[str, Readings]
    joints: Mapping[str, Readings]
    setpoint_joints: Mapping[str, Readings]
    visibility: Readings | None
    quality: DataQuality

    @property
    def cloud_times_s(self) -> Floats:
        return np.array([cloud.stamp_s for cloud in self.clouds])
