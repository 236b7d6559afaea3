"""What estimating noise from a fitted residual gets wrong, measured on surrogates and undone.

A residual from which the best of many causes was removed is smaller and less autocorrelated than
the noise was, the more so the fewer independent samples there are; thresholds made from it would
be passed too often. Surrogates go through the same fit and the same estimate; how far they come out
from where they started is taken back (Kilian 1998), and their scatter says how well the noise is
known at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.diagnosis.autoregression import (
    autoregression,
    partial_autocorrelations,
    stationary_variance,
)
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import ChannelNoise, Noise, estimate_noise
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_SURELY_STATIONARY = 0.999


@dataclass(frozen=True)
class KnownNoise:
    """``middle``: the best estimate; ``variants``: noises that it may as well be."""

    middle: Noise
    variants: tuple[Noise, ...]


def corrected(
    noise: Noise,
    residual: Floats,
    samples: Samples,
    found: Layout,
    refit: Callable[[Floats], Floats],
    count: int,
    rng: np.random.Generator,
) -> KnownNoise:
    """``noise`` as estimated from ``residual`` (n,), less its bias.

    ``refit`` does to surrogates (n, m) what was done to the data to get ``residual``.
    """
    orders = [len(channel.ar) for channel in noise.channels]
    drawn = np.concatenate(list(surrogates(noise, residual, count, rng)), axis=1)
    left = np.where(noise.seen[:, None], refit(drawn), np.nan)
    again = [estimate_noise(column, samples, found, orders).channels for column in left.T]
    middle, variants = [], []
    for index, channel in enumerate(noise.channels):
        here = _numbers(channel)
        there = np.array([_numbers(one[index]) for one in again])
        centre = 2.0 * here - there.mean(axis=0)
        middle.append(_channel(centre))
        variants.append([_channel(centre + number - there.mean(axis=0)) for number in there])
    return KnownNoise(
        replace(noise, channels=tuple(middle)),
        tuple(replace(noise, channels=tuple(v[i] for v in variants)) for i in range(count)),
    )


def _numbers(noise: ChannelNoise) -> Floats:
    """A noise as unbounded numbers: partial autocorrelations (Fisher's z), log innovation."""
    partial = np.clip(partial_autocorrelations(noise.ar), -_SURELY_STATIONARY, _SURELY_STATIONARY)
    return np.append(np.arctanh(partial), np.log(noise.innovation_sd))


def _channel(numbers: Floats) -> ChannelNoise:
    partial = np.tanh(np.clip(numbers[:-1], -3.8, 3.8))
    ar, innovation_sd = autoregression(partial), float(np.exp(numbers[-1]))
    sd = innovation_sd
    if len(ar):
        sd = float(np.sqrt(stationary_variance(ar, innovation_sd)))
    return ChannelNoise(sd, ar, innovation_sd)
