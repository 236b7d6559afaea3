"""Whether something is left that no candidate explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_PREDICTABLE = 0.15


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
) -> LeftOver:
    """Examine ``residual`` (n,), whose noise was estimated as ``noise``.

    A sensor's mean square must exceed its scatter by more than 95 % of surrogates vary, and by
    more than the floor squared; and its own past must predict a part, or channels move together.
    """
    scatter = np.array([c.noise_sd for c in samples.channels])[samples.channel]
    floor = np.array([c.floor for c in samples.channels])[samples.channel]
    drawn = np.concatenate(list(surrogates(noise, residual, count, rng)), axis=1)
    sensors = []
    for sensor in dict.fromkeys(c.sensor for c in samples.channels):
        own = [i for i, c in enumerate(samples.channels) if c.sensor == sensor]
        keep = np.isin(samples.channel, own) & np.isfinite(residual)
        if not keep.any():
            continue
        square = float(np.mean(residual[keep] ** 2))
        spread = np.mean(drawn[keep] ** 2, axis=0)
        ratio = float(np.quantile(spread / max(spread.mean(), 1e-300), 0.95))
        expected = float(np.mean(scatter[keep] ** 2)) * ratio
        practical = float(np.mean(floor[keep] ** 2))
        if square <= expected + practical:
            continue
        if _order(noise, own) > _PREDICTABLE:
            sensors.append(sensor)
    return LeftOver(tuple(sensors))


def _order(noise: Noise, channels: list[int]) -> float:
    """Share of the variance that the past predicts, in the most ordered channel."""
    return max(
        1.0 - (noise.channels[c].innovation_sd / max(noise.channels[c].sd, 1e-300)) ** 2
        for c in channels
    )
