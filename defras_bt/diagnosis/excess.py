"""Error above what sensors scatter, and how much of it is gone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.diagnosis import ExcessOf
from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Samples
from defras_sim.geometry import Floats


def excess_of_sensors(residual: Floats, samples: Samples) -> dict[str, float]:
    """Sum of squares above the sensors' scatter, in tolerances squared, so that sensors of
    different units add up. Never below zero for a sensor; its channels, which by chance lie above
    and below their scatter, are summed before."""
    tolerance = tolerances(samples)
    found = {channel.sensor: 0.0 for channel in samples.channels}
    for index, channel in enumerate(samples.channels):
        values = residual[samples.channel == index]
        values = values[np.isfinite(values)]
        above = float(np.sum(values**2)) - len(values) * channel.noise_sd**2
        found[channel.sensor] += above / float(tolerance[index]) ** 2
    return {sensor: max(above, 0.0) for sensor, above in found.items()}


def excess(residual: Floats, samples: Samples) -> float:
    """Of all sensors together."""
    return sum(excess_of_sensors(residual, samples).values())


def removed_share(before: Floats, after: Floats, samples: Samples) -> float | None:
    """Share of the excess of residual ``before`` (n,) that ``after`` lacks; negative where it
    grew; None where there was none."""
    there = np.isfinite(before) & np.isfinite(after)
    first = excess(np.where(there, before, np.nan), samples)
    if first <= 0.0:
        return None
    return float(1.0 - excess(np.where(there, after, np.nan), samples) / first)


def excess_by_sensor(before: Floats, after: Floats, samples: Samples) -> tuple[ExcessOf, ...]:
    """Excess of each sensor before and after, with root mean squares in its unit."""
    rows = []
    first, last = excess_of_sensors(before, samples), excess_of_sensors(after, samples)
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
                first[sensor] / int(keep.sum()),
                last[sensor] / int(keep.sum()),
                float(np.sqrt(np.mean(before[keep] ** 2))),
                float(np.sqrt(np.mean(after[keep] ** 2))),
                float(np.sqrt(np.mean(noise[samples.channel[keep]] ** 2))),
            )
        )
    return tuple(rows)


def is_practical(
    change: Floats,
    without: Floats,
    with_it: Floats,
    samples: Samples,
    share: float,
    floors: float = 1.0,
) -> bool:
    """Whether a cause that changes predictions by ``change`` (n,) is worth naming; ``floors``: by
    how many times the practical floors a change has to be larger.

    Some sensor has to say so, each by itself: how many millimetres a newton is worth nobody knows,
    and one sensor's large error is no reason to overlook what another sees. See
    :func:`_matters_to`.
    """
    tolerance = tolerances(samples)[samples.channel]
    seen = np.isfinite(change) & np.isfinite(without) & np.isfinite(with_it)
    return any(
        _matters_to(sensor, seen, change, without, with_it, samples, tolerance, share, floors)
        for sensor in dict.fromkeys(channel.sensor for channel in samples.channels)
    )


def _matters_to(
    sensor: str,
    seen: NDArray[np.bool_],
    change: Floats,
    without: Floats,
    with_it: Floats,
    samples: Samples,
    tolerance: Floats,
    share: float,
    floors: float,
) -> bool:
    """The change is, root mean square, more than the practical floor of one of the sensor's
    channels; its square is at least ``share`` of the sensor's excess; and held-out residuals,
    ``without`` and ``with_it`` (n,), do not contradict it: what is noisy and slow may hide a gain,
    but hardly turns it into a loss."""
    own = [i for i, channel in enumerate(samples.channels) if channel.sensor == sensor]
    large = False
    for index in own:
        values = change[(samples.channel == index) & seen]
        floor = floors * samples.channels[index].floor
        if len(values) and float(np.sqrt(np.mean(values**2))) > floor:
            large = True
    if not large:
        return False
    rows = seen & np.isin(samples.channel, own)
    size = float(np.sum((change[rows] / tolerance[rows]) ** 2))
    gain = float(np.sum((without[rows] ** 2 - with_it[rows] ** 2) / tolerance[rows] ** 2))
    present = excess_of_sensors(np.where(rows, without, np.nan), samples)[sensor]
    return size >= share * present and gain > -0.5 * size
