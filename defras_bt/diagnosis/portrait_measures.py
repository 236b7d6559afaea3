"""What a portrait measures: functions of residuals that make one kind of cause visible.

Each works on many residuals at once, the measured one and surrogates, so that every number comes
with what chance gives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.diagnosis import StatisticKind
from defras_bt.diagnosis.layout import Layout, Series
from defras_bt.diagnosis.problem import Channel, Covariate, Integers, Samples
from defras_sim.geometry import Floats

_LONG_ENOUGH = 8
_STILL = ("hold", "rest", "still")
_SLOWEST_LINE = 4
"""Periods in a recording from which on a line is a line, not a trend."""


@dataclass(frozen=True)
class Measure:
    """``of`` maps residuals (n, s), zero where nothing is compared, to numbers (s,) in ``unit``.

    ``says`` has a place for the number and its unit.
    """

    kind: StatisticKind
    sensor: str
    unit: str
    of: Callable[[Floats], Floats]
    says: str
    channel: str = ""
    phase: str = ""


def means(samples: Samples, seen: Integers) -> Iterator[Measure]:
    """Constant errors, as offsets and scales make them."""
    for index, channel in enumerate(samples.channels):
        rows = seen[samples.channel[seen] == index]
        if len(rows):
            yield _contrast(
                "mean", channel, np.full(len(rows), 1.0 / len(rows)), rows, "is {} off on average"
            )


def drifts(samples: Samples, seen: Integers, found: Layout) -> Iterator[Measure]:
    """How far readings creep while nothing moves, as relaxation makes them."""
    still = [i for i, name in enumerate(samples.phases) if any(word in name for word in _STILL)]
    for index, channel in enumerate(samples.channels):
        weights, rows = [], []
        for one in (one for one in found.series if one.channel == index):
            own = seen[(seen >= one.start) & (seen < one.stop)]
            for run in _runs(own[np.isin(samples.phase[own], still)]):
                time = samples.time_s[run] - samples.time_s[run].mean()
                span = float(samples.time_s[run[-1]] - samples.time_s[run[0]])
                weights.append(time / float(time @ time) * span)
                rows.append(run)
        if rows:
            weight = np.concatenate(weights) / len(rows)
            says = "creeps by {} during a hold"
            yield _contrast("drift", channel, weight, np.concatenate(rows), says, "hold")


def reversals(
    samples: Samples, seen: Integers, found: Layout, covariate: Covariate
) -> Iterator[Measure]:
    """Difference between going up and going down, as play and hysteresis make it."""
    rate = _rate(samples, found, covariate)
    for index, channel in enumerate(samples.channels):
        rows = seen[(samples.channel[seen] == index) & (np.abs(rate[seen]) > 0.0)]
        up = rate[rows] > 0.0
        if up.sum() < _LONG_ENOUGH or (~up).sum() < _LONG_ENOUGH:
            continue
        weight = np.where(up, 1.0 / up.sum(), -1.0 / (~up).sum())
        says = f"differs by {{}} between rising and falling {covariate.name}"
        yield _contrast("reversal", channel, weight, rows, says)


def slopes(
    samples: Samples, seen: Integers, found: Layout, covariate: Covariate
) -> Iterator[Measure]:
    """What a residual grows by over most of a covariate's range; for what should be followed also
    how late it is."""
    rate = _rate(samples, found, covariate)
    for index, channel in enumerate(samples.channels):
        rows = seen[(samples.channel[seen] == index) & np.isfinite(covariate.values[seen])]
        if len(rows) < _LONG_ENOUGH:
            continue
        values = covariate.values[rows] - covariate.values[rows].mean()
        if float(values @ values) > 0.0:
            span = 4.0 * float(values.std())
            says = f"changes by {{}} over the range of {covariate.name}"
            yield _contrast("slope", channel, values / float(values @ values) * span, rows, says)
        speed = np.nan_to_num(rate[rows])
        if covariate.followed and float(speed @ speed) > 0.0:
            weight = -speed / float(speed @ speed)
            yield _contrast("lag", channel, weight, rows, "comes {} late", unit="s")


def jumps(samples: Samples, seen: Integers, found: Layout) -> Iterator[Measure]:
    """The largest step between two successive tenths of a recording, as a slip or tear makes."""
    for index, channel in enumerate(samples.channels):
        parts = []
        for one in (one for one in found.series if one.channel == index):
            rows = seen[(seen >= one.start) & (seen < one.stop)]
            if len(rows) >= 4 * _LONG_ENOUGH:
                parts.append((rows, max(len(rows) // 10, _LONG_ENOUGH)))
        if parts:
            says = "jumps by {} at once"
            yield Measure(
                "jump",
                channel.sensor,
                channel.unit,
                _largest_step(parts),
                _named(channel, says),
                channel.name,
            )


def lines(samples: Samples, seen: Integers, found: Layout) -> Iterator[Measure]:
    """The largest share that one frequency has in a sensor's squares, as breathing makes it."""
    for sensor in dict.fromkeys(channel.sensor for channel in samples.channels):
        own = [
            one
            for one in found.series
            if samples.channels[one.channel].sensor == sensor and one.length >= 8 * _SLOWEST_LINE
        ]
        if own:
            says = f"{sensor}: {{}} of the squared error swings at one frequency."
            yield Measure("line", sensor, "", _largest_line(own, seen, found.size), says)


def _contrast(
    kind: StatisticKind,
    channel: Channel,
    weight: Floats,
    rows: Integers,
    says: str,
    phase: str = "",
    unit: str | None = None,
) -> Measure:
    return Measure(
        kind,
        channel.sensor,
        channel.unit if unit is None else unit,
        lambda residuals: np.asarray(weight @ residuals[rows]),
        _named(channel, says),
        channel.name,
        phase,
    )


def _named(channel: Channel, says: str) -> str:
    return f"{channel.name} {says} beside the simulation."


def _runs(rows: Integers) -> list[Integers]:
    """Runs of successive rows that are long enough."""
    if not len(rows):
        return []
    parts = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    return [part for part in parts if len(part) >= _LONG_ENOUGH]


def _rate(samples: Samples, found: Layout, covariate: Covariate) -> Floats:
    """Change of a covariate per second (n,), NaN where there is none."""
    rate = np.full(len(samples.time_s), np.nan)
    for one in found.series:
        if one.stop - one.start > 1:
            rate[one.rows] = np.gradient(covariate.values[one.rows], samples.time_s[one.rows])
    return rate


def _largest_step(parts: list[tuple[Integers, int]]) -> Callable[[Floats], Floats]:
    def of(residuals: Floats) -> Floats:
        largest = np.zeros(residuals.shape[1])
        for rows, width in parts:
            sums = np.cumsum(np.insert(residuals[rows], 0, 0.0, axis=0), axis=0)
            mean = (sums[width:] - sums[:-width]) / width
            largest = np.maximum(largest, np.abs(mean[width:] - mean[:-width]).max(axis=0))
        return largest

    return of


def _largest_line(own: list[Series], seen: Integers, size: int) -> Callable[[Floats], Floats]:
    valid = np.zeros(size, dtype=bool)
    valid[seen] = True

    def of(residuals: Floats) -> Floats:
        share = np.zeros(residuals.shape[1])
        by_length: dict[int, Floats] = {}
        for one in own:
            grid = np.zeros((one.length, residuals.shape[1]))
            keep = valid[one.rows]
            grid[one.slot[keep]] = residuals[one.rows][keep]
            power = np.abs(np.fft.rfft(grid, axis=0)) ** 2
            by_length[one.length] = by_length.get(one.length, np.zeros_like(power)) + power
        for power in by_length.values():
            fast = power[_SLOWEST_LINE:]
            total = np.maximum(power.sum(axis=0), 1e-300)
            share = np.maximum(share, fast.max(axis=0, initial=0.0) / total)
        return share

    return of
