"""Whether something is left that no candidate explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_PREDICTABLE = 0.15
"""Share of a variance."""
_CHANCE = 0.95


@dataclass(frozen=True)
class LeftOver:
    """What a residual holds beyond the sensor: sensors where it is more than noise, chance and the
    practical floor together, and not without order."""

    sensors: tuple[str, ...]


def left_over(
    residual: Floats,
    samples: Samples,
    noise: Noise,
    count: int,
    rng: np.random.Generator,
    off: Floats | None = None,
) -> LeftOver:
    """Examine ``residual`` (n,), whose noise was estimated as ``noise``.

    The mean square of a sensor, or of one of its channels, must exceed its scatter by more than
    surrogates vary (of channels: the one that varies most), and by more than the floor squared;
    and its own past must predict a part. By chance that happens to any of all sensors in 5 %
    (Sidak 1967).

    ``off`` (n, m): draws of what the twin itself may be off by. Floors say what is usual in one
    channel; of many, the one that is off most is farther off than that by chance, and all are
    where causes change much.
    """
    drawn = np.concatenate(list(surrogates(noise, residual, count, rng)), axis=1)
    sensors = []
    names = [c.sensor for c in samples.channels]
    tests = sum(1 if names.count(sensor) == 1 else 2 for sensor in dict.fromkeys(names))
    chance = _CHANCE ** (1.0 / tests)
    for sensor in dict.fromkeys(names):
        own = [i for i, c in enumerate(samples.channels) if c.sensor == sensor]
        rows = [np.flatnonzero((samples.channel == i) & np.isfinite(residual)) for i in own]
        own = [i for i, keep in zip(own, rows, strict=True) if len(keep)]
        rows = [keep for keep in rows if len(keep)]
        if not own:
            continue
        counts = np.array([len(keep) for keep in rows], dtype=float)
        squares = np.array([np.mean(residual[keep] ** 2) for keep in rows])
        spread = np.stack([np.mean(drawn[keep] ** 2, axis=0) for keep in rows])
        spread = spread / np.maximum(spread.mean(axis=1, keepdims=True), 1e-300)
        scatter = np.array([samples.channels[i].noise_sd ** 2 for i in own])
        floor = np.array([samples.channels[i].floor ** 2 for i in own])
        largest = float(np.quantile(spread.max(axis=0), chance))
        usual = scatter * largest + floor
        own_error = float(counts @ floor)
        if off is not None:
            squared = np.stack([np.mean(off[keep] ** 2, axis=0) for keep in rows])
            worst = np.max((scatter[:, None] + squared) / usual[:, None], axis=0)
            usual = usual * max(1.0, float(np.quantile(worst, chance)))
            own_error = max(own_error, float(np.quantile(counts @ squared, chance)))
        together = float(np.quantile(counts @ (scatter[:, None] * spread), chance))
        whole = counts @ squares > together + own_error
        single = squares > usual
        conspicuous = own if whole else [i for i, one in zip(own, single, strict=True) if one]
        if conspicuous and _order(noise, conspicuous) > _PREDICTABLE:
            sensors.append(sensor)
    return LeftOver(tuple(sensors))


def _order(noise: Noise, channels: list[int]) -> float:
    """Share of the variance that the past predicts, in the most ordered channel."""
    return max(
        1.0 - (noise.channels[c].innovation_sd / max(noise.channels[c].sd, 1e-300)) ** 2
        for c in channels
    )
