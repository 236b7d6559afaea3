"""Error above what sensors scatter, and how much of it is gone."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.diagnosis import ExcessOf
from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Samples
from defras_sim.geometry import Floats


def excess_of_channels(residual: Floats, samples: Samples) -> Floats:
    """Mean square (c,) above the sensor's scatter in tolerances squared, times the channel's
    number of samples; never below zero. Channels of different units can be added up then."""
    tolerance = tolerances(samples)
    found = np.zeros(len(samples.channels))
    for index, channel in enumerate(samples.channels):
        values = residual[samples.channel == index]
        values = values[np.isfinite(values)]
        if len(values):
            above = float(np.mean(values**2)) - channel.noise_sd**2
            found[index] = len(values) * max(above, 0.0) / tolerance[index] ** 2
    return found


def removed_share(before: Floats, after: Floats, samples: Samples) -> float | None:
    """Share of the excess of residual ``before`` (n,) that ``after`` lacks; negative where it
    grew; None where there was none."""
    there = np.isfinite(before) & np.isfinite(after)
    first = excess_of_channels(np.where(there, before, np.nan), samples).sum()
    if first <= 0.0:
        return None
    return float(1.0 - excess_of_channels(np.where(there, after, np.nan), samples).sum() / first)


def excess_by_sensor(before: Floats, after: Floats, samples: Samples) -> tuple[ExcessOf, ...]:
    """Excess of each sensor before and after, with root mean squares in its unit."""
    rows = []
    first, last = excess_of_channels(before, samples), excess_of_channels(after, samples)
    for sensor in dict.fromkeys(channel.sensor for channel in samples.channels):
        own = [i for i, channel in enumerate(samples.channels) if channel.sensor == sensor]
        keep = np.isin(samples.channel, own) & np.isfinite(before) & np.isfinite(after)
        if not keep.any():
            continue
        noise = np.array([channel.noise_sd for channel in samples.channels])
        rows.append(
            ExcessOf(
                sensor,
                samples.channels[own[0]].unit,
                float(first[own].sum() / keep.sum()),
                float(last[own].sum() / keep.sum()),
                float(np.sqrt(np.mean(before[keep] ** 2))),
                float(np.sqrt(np.mean(after[keep] ** 2))),
                float(np.sqrt(np.mean(noise[samples.channel[keep]] ** 2))),
            )
        )
    return tuple(rows)


def is_practical(
    change: Floats, without: Floats, with_it: Floats, samples: Samples, share: float
) -> bool:
    """Whether a cause that changes predictions by ``change`` (n,) is worth naming.

    The change is, root mean square, more than the practical floor of some channel; its square is
    at least ``share`` of the excess; and held-out residuals, ``without`` and ``with_it`` (n,), do
    not contradict it: what is noisy and slow may hide a gain, but hardly turns it into a loss.
    """
    tolerance = tolerances(samples)[samples.channel]
    seen = np.isfinite(change) & np.isfinite(without) & np.isfinite(with_it)
    large = False
    for index, channel in enumerate(samples.channels):
        values = change[(samples.channel == index) & seen]
        if len(values) and float(np.sqrt(np.mean(values**2))) > channel.floor:
            large = True
    size = float(np.sum((change[seen] / tolerance[seen]) ** 2))
    gain = float(np.sum((without[seen] ** 2 - with_it[seen] ** 2) / tolerance[seen] ** 2))
    excess = float(excess_of_channels(without, samples).sum())
    return large and size >= share * excess and gain > -0.5 * size
