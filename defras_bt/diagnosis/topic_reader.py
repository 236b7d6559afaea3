"""One topic after the other out of a bag: units, frames, clocks, and rows that cannot be believed.

Whatever is found wrong is kept for the report on the data's quality. What is needed and cannot be
had ends the reading; what is optional and unusable is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.diagnosis.quality import DataFault, DataQuality, Sieve
from defras_bt.diagnosis.quality_checks import (
    backward_rows,
    pauses_s,
    spike_rows,
    unfinite_rows,
    zero_rows,
)
from defras_bt.diagnosis.recording import Readings
from defras_bt.diagnosis.topic_map import (
    TISSUE_FRAME,
    AngleSource,
    FlagSource,
    ForceSource,
    LengthSource,
    TopicMap,
)
from defras_bt.recording.bag_reader import Bag, Series
from defras_sim.geometry import Floats, Pose

# Nothing that belongs to an operation is farther from the tissue than this.
FAR_M = 1.0
SPIKE_M = 0.005
"""A single tip this far from the readings on both sides of it was not there."""
STRONG_N = 100.0
MOST_RAD = 7.0
CLOCK_S = 0.25
"""Two clocks that differ by more are two clocks; by less it may be the age of a reading."""

_UNSTAMPED = ("std_msgs/msg/Bool", "std_msgs/msg/Float64", "std_msgs/msg/String")

Source = LengthSource | AngleSource | ForceSource | FlagSource


class UnusableRecording(ValueError):
    """A recording with which nothing can be compared."""


@dataclass(frozen=True)
class PoseReadings:
    """tissue_from_tip at increasing times (n,): positions (n, 3), rotations (n, 3, 3)."""

    time_s: Floats
    position_m: Floats
    rotation: Floats


class TopicReader:
    """Reads the topics of one bag; times are seconds since the first set-point."""

    def __init__(self, file: str, bag: Bag, topics: TopicMap) -> None:
        self._file = file
        self._bag = bag
        self._topics = topics
        self._rows: dict[str, int] = {}
        self._faults: list[DataFault] = []
        self._clock_s = 0.0
        self._start_s = 0.0
        self._set_clock()

    @property
    def quality(self) -> DataQuality:
        """Everything found wrong in what has been read until now."""
        return DataQuality(dict(self._rows), tuple(self._faults))

    def has(self, source: Source | None) -> bool:
        return source is not None and source.topic in self._bag.series

    def missing(self, what: str, source: Source) -> UnusableRecording:
        """The error for something without which nothing can be compared."""
        held = sorted({*self._bag.series, *self._bag.unread})
        there = ", ".join(held) or "nothing that can be read"
        return UnusableRecording(
            f"{self._file}: {what} should be on {source.topic}, which is not in the recording. It "
            f"holds: {there}. A topic map (--topics) says where things stand"
        )

    def poses(self, source: LengthSource) -> PoseReadings:
        """tissue_from_tip as far as it can be believed."""
        series = self._typed(source, "geometry_msgs/msg/PoseStamped")
        sieve = self._sieve(source, series)
        position = series.values[:, :3] * source.scale
        turned = series.values[:, 3:7]
        self._check_rows(sieve, series.values, where=position)
        sieve.leave_out(
            np.abs(np.linalg.norm(turned, axis=1) - 1.0) > 0.05, "not_finite", "not a rotation"
        )
        kept = sieve.kept
        placed = self._tissue_from(source, series)
        position = placed.apply(position[kept])
        rotation = np.zeros((0, 3, 3))
        if kept.any():
            rotation = placed.rotation @ Rotation.from_quat(turned[kept]).as_matrix()
            position = position + source.tip_beyond_m * rotation[:, :, 2]
        self.require_near(source, position)
        return PoseReadings(self._kept_times(sieve, source, series), position, rotation)

    def positions(self, source: LengthSource | None) -> Readings | None:
        """Tips (3 columns), None where the bag has none."""
        if source is None or not self.has(source):
            return None
        found = self.poses(source)
        return Readings(found.time_s, found.position_m)

    def forces(self, source: ForceSource | None) -> Readings | None:
        """Forces on the tissue (3 columns) along the tissue frame's axes."""
        if source is None or not self.has(source):
            return None
        series = self._typed(source, "geometry_msgs/msg/WrenchStamped")
        sieve = self._sieve(source, series)
        force = series.values[:, :3] * source.scale
        self._check_rows(sieve, force)
        size = np.linalg.norm(force[sieve.kept], axis=1)
        if len(size) and np.median(size) > STRONG_N:
            what = f"forces of {np.median(size):.0f} N: not newtons? Give unit: mN in the topic map"
            sieve.leave_out(sieve.kept, "unit", what)
        turn = self._tissue_from(source, series).rotation
        times = self._kept_times(sieve, source, series)
        return Readings(times, force[sieve.kept] @ turn.T)

    def joints(self, source: AngleSource | None) -> Readings | None:
        """Joint positions, the third of six a length and all others angles."""
        if source is None or not self.has(source):
            return None
        series = self._typed(source, "sensor_msgs/msg/JointState")
        sieve = self._sieve(source, series)
        values = series.values.copy()
        turning = [i for i in range(values.shape[1]) if not (values.shape[1] >= 6 and i == 2)]
        values[:, turning] *= source.scale
        self._check_rows(sieve, values)
        largest = np.abs(values[sieve.kept][:, turning]).max(initial=0.0)
        if largest > MOST_RAD:
            what = f"angles up to {largest:.0f} rad: degrees? Give unit: deg in the topic map"
            sieve.leave_out(sieve.kept, "unit", what)
        return Readings(self._kept_times(sieve, source, series), values[sieve.kept])

    def numbers(self, source: FlagSource | None) -> Readings | None:
        """A number or a flag (1 column)."""
        if source is None or not self.has(source):
            return None
        series = self._typed(source, "std_msgs/msg/Bool", "std_msgs/msg/Float64")
        sieve = self._sieve(source, series)
        sieve.leave_out(unfinite_rows(series.values), "not_finite", "values that are no numbers")
        times = self._kept_times(sieve, source, series)
        return Readings(times, series.values[sieve.kept])

    def series(self, source: LengthSource) -> tuple[Series, Sieve, Pose]:
        """A cloud topic as it is, with its sieve and tissue_from_frame."""
        series = self._typed(source, "sensor_msgs/msg/PointCloud2")
        return series, self._sieve(source, series), self._tissue_from(source, series)

    def times_s(self, source: Source, series: Series) -> Floats:
        """When each message was measured; NaN where nothing tells."""
        if series.message_type in _UNSTAMPED or self._topics.stamps == "received":
            stamp_s = series.time_s + (0.0 if self._topics.stamps == "received" else self._clock_s)
        elif np.all(series.stamp_s == series.stamp_s[0]) and len(series.stamp_s) > 1:
            what = "stamps that never change; the times of reception are taken"
            self._report_once(DataFault(source.topic, "clock_offset", (), 0, what))
            stamp_s = series.time_s + self._clock_s
        else:
            stamp_s = series.stamp_s + self._offset_s(source, series)
        return np.asarray(stamp_s + source.clock_offset_s - self._start_s)

    def keep(self, sieve: Sieve, times_s: Floats) -> None:
        """Enter what ``sieve`` found; ``times_s`` are those of the rows that are left."""
        self._faults += sieve.faults
        for start, end in pauses_s(times_s):
            what = f"nothing for {end - start:.2f} s"
            self._faults.append(DataFault(sieve.source, "drop_out", ((start, end),), 0, what))

    def _set_clock(self) -> None:
        """The clock of the first arm's set-points is that of the recording."""
        for arm in self._topics.arms.values():
            if not self.has(arm.setpoint):
                continue
            series = self._bag[arm.setpoint.topic]
            if series.message_type not in _UNSTAMPED and self._topics.stamps == "header":
                finite = series.stamp_s[series.stamp_s != 0.0]
                if len(finite):
                    self._clock_s = float(np.median(series.stamp_s - series.time_s))
            times = self.times_s(arm.setpoint, series)
            self._start_s = float(np.nanmin(times))
            return

    def _offset_s(self, source: Source, series: Series) -> float:
        """What brings a clock to that of the set-points."""
        with np.errstate(invalid="ignore"):
            behind_s = self._clock_s - float(
                np.nanmedian(series.stamp_s + source.clock_offset_s - series.time_s)
            )
        if abs(behind_s) < CLOCK_S:
            return 0.0
        what = (
            f"another clock: its stamps are {abs(behind_s):.2f} s "
            f"{'behind' if behind_s > 0 else 'ahead of'} those of the set-points and were shifted"
        )
        self._report_once(DataFault(source.topic, "clock_offset", (), 0, what))
        return behind_s

    def _report_once(self, fault: DataFault) -> None:
        if fault not in self._faults:
            self._faults.append(fault)

    def _typed(self, source: Source, *types: str) -> Series:
        series = self._bag[source.topic]
        if series.message_type not in types:
            raise UnusableRecording(
                f"{self._file}: {source.topic} should be of type {' or '.join(types)}, is "
                f"{series.message_type}"
            )
        return series

    def _sieve(self, source: Source, series: Series) -> Sieve:
        times = self.times_s(source, series)
        self._rows[source.topic] = len(times)
        sieve = Sieve(source.topic, times)
        sieve.leave_out(backward_rows(times), "time_backwards", "time does not go forward")
        return sieve

    def _check_rows(self, sieve: Sieve, values: Floats, where: Floats | None = None) -> None:
        sieve.leave_out(unfinite_rows(values), "not_finite", "values that are no numbers")
        # A closed jaw and an unloaded sensor may well say zero; a tip and six joints do not.
        if values.shape[1] >= 6:
            sieve.leave_out(zero_rows(values), "zeros", "rows of zeros")
        if where is not None:
            sieve.leave_out(zero_rows(where), "zeros", "rows of zeros")
            sieve.leave_out(
                spike_rows(where, SPIKE_M, sieve.kept), "outlier", "a tip that jumps there and back"
            )

    def _kept_times(self, sieve: Sieve, source: Source, series: Series) -> Floats:
        times = self.times_s(source, series)[sieve.kept]
        self.keep(sieve, times)
        return times

    def _tissue_from(self, source: Source, series: Series) -> Pose:
        frame = source.frame or series.frame_id
        if frame == TISSUE_FRAME:
            return Pose(np.zeros(3))
        place = self._topics.frames.get(frame)
        if place is None:
            named = f"is in the frame {frame!r}" if frame else "names no frame"
            known = ", ".join(self._topics.frames) or "none yet"
            raise UnusableRecording(
                f"{self._file}: {source.topic} {named}, and the topic map does not say where that "
                f"stands. Give it under frames: (there: {known}), or frame: {TISSUE_FRAME} for "
                f"{source.topic} if it is in the tissue's frame"
            )
        return place.tissue_from_frame

    def require_near(self, source: LengthSource, position_m: Floats) -> None:
        """Refuse what is far from any tissue: a wrong unit or frame, and which one is a guess.

        Raises:
            UnusableRecording: it is, or nothing is left.
        """
        if len(position_m) == 0:
            raise UnusableRecording(f"{self._file}: no row of {source.topic} can be used")
        away_m = float(np.median(np.linalg.norm(position_m, axis=1)))
        if away_m <= FAR_M:
            return
        guess = (
            "that looks like millimetres: give unit: mm in the topic map"
            if source.unit == "m" and away_m / 1000 <= FAR_M
            else "give its frame's place in the topic map"
        )
        raise UnusableRecording(
            f"{self._file}: {source.topic} lies {away_m:.3g} m from the tissue; {guess}"
        )
