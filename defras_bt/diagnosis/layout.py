"""Where the time series are within the numbers that are compared."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.problem import Integers, Samples

_LONGEST_GAP = 500
"""Steps; nothing that is left of an autocorrelation after as many is worth knowing."""


@dataclass(frozen=True)
class Series:
    """One channel in one trajectory: samples ``start`` to ``stop``, taken at steps ``slot`` (from
    0, increasing; gaps skip steps)."""

    start: int
    stop: int
    channel: int
    trajectory: int
    slot: Integers

    @property
    def rows(self) -> slice:
        return slice(self.start, self.stop)

    @property
    def length(self) -> int:
        """Steps from its first to its last sample."""
        return int(self.slot[-1]) + 1


@dataclass(frozen=True)
class Layout:
    """All series in order. ``together``: series of one trajectory with the same steps, whose noise
    may be correlated across channels."""

    series: tuple[Series, ...]
    together: tuple[tuple[Series, ...], ...]
    size: int

    @cached_property
    def ends(self) -> Integers:
        """First row of every series and the one after its last (s, 2)."""
        return np.array([(one.start, one.stop) for one in self.series])

    @cached_property
    def slot(self) -> Integers:
        """Step of every sample (n,) in its series."""
        return np.concatenate([one.slot for one in self.series])

    @cached_property
    def channel(self) -> Integers:
        """Of every series (s,)."""
        return np.array([one.channel for one in self.series])

    def counts(self, chosen: NDArray[np.bool_]) -> Integers:
        """How many of the ``chosen`` samples (n,) are in every series (s,)."""
        return np.add.reduceat(chosen.astype(np.int64), self.ends[:, 0])


def layout(samples: Samples) -> Layout:
    """Find the series of ``samples``.

    Raises:
        ValueError: labels differ in length, or samples are not sorted by trajectory, channel and
            time.
    """
    size = len(samples.time_s)
    for name in ("channel", "trajectory", "phase", "fold"):
        if len(getattr(samples, name)) != size:
            raise ValueError(
                f"samples: {name} labels {len(getattr(samples, name))} numbers, time_s {size}; "
                "all labels should be of the same length"
            )
    if not size:
        raise ValueError("samples: there are none; a diagnosis needs something to compare")
    block = samples.trajectory.astype(np.int64) * len(samples.channels) + samples.channel
    if np.any(np.diff(block) < 0):
        at = int(np.argmax(np.diff(block) < 0)) + 1
        raise ValueError(f"samples should be sorted by trajectory, channel and time; {at} is not")
    starts = np.flatnonzero(np.diff(block, prepend=-1))
    stops = np.append(starts[1:], size)
    series = tuple(
        Series(
            int(start),
            int(stop),
            int(samples.channel[start]),
            int(samples.trajectory[start]),
            _slots(samples, int(start), int(stop)),
        )
        for start, stop in zip(starts, stops, strict=True)
    )
    groups: dict[tuple[int, bytes], list[Series]] = {}
    for one in series:
        groups.setdefault((one.trajectory, one.slot.tobytes()), []).append(one)
    return Layout(series, tuple(tuple(group) for group in groups.values()), size)


def _slots(samples: Samples, start: int, stop: int) -> Integers:
    """Times as whole numbers of the usual step between them."""
    gaps = np.diff(samples.time_s[start:stop])
    if np.any(gaps <= 0.0):
        at = start + int(np.argmax(gaps <= 0.0)) + 1
        name = samples.channels[samples.channel[at]].name
        raise ValueError(
            f"samples: time of {name} in {samples.trajectories[samples.trajectory[at]]} does not "
            f"increase at {samples.time_s[at]:g} s (sample {at})"
        )
    if not len(gaps):
        return np.zeros(1, dtype=np.int64)
    steps = np.clip(np.rint(gaps / np.median(gaps)), 1, _LONGEST_GAP).astype(np.int64)
    return np.concatenate(([0], np.cumsum(steps)))
