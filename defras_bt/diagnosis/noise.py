"""Autocorrelated noise: estimated from a residual, per channel, with gaps and outliers.

Residuals of simulations are anything but independent, and tests that assume they are always find
something. What the residual's own past predicts is therefore taken out of everything before it is
compared (generalised least squares).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.autoregression import tamed
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.problem import Channel, Samples
from defras_bt.diagnosis.series import lagged_products, robust_sds, whitened
from defras_sim.geometry import Floats

_ORDERS = (0, 1, 2, 3, 4, 6, 8)
_SHARED = 300.0
"""Samples' worth of weight that the other channels of the same sensor have in a channel's
autocorrelation: short series borrow, long ones keep their own."""
_FEWEST = 20.0
"""Samples of a sensor below which its autocorrelation is not asked for."""
_LARGEST = 4.0
"""Robust standard deviations beyond which a residual is an outlier."""
_WILDEST = 2.0
"""Variance that an autoregression may imply, of the one that was seen."""
_FINELY = 0.002
"""How well the share is found to which the roots of an autoregression have to be pulled in."""


@dataclass(frozen=True)
class ChannelNoise:
    """``x_t = sum_k ar[k-1] x_{t-k} + innovation_sd e_t`` with standard deviation ``sd``."""

    sd: float
    ar: Floats
    innovation_sd: float


@dataclass(frozen=True)
class Noise:
    """``seen`` (n,): samples that are compared. ``weight`` (n,): 1, less where a sample is an
    outlier."""

    layout: Layout
    channels: tuple[ChannelNoise, ...]
    seen: NDArray[np.bool_]
    weight: Floats

    def whiten(self, columns: Floats) -> Floats:
        """``columns`` (n, k) in units in which this noise is independent and of variance 1; zero
        where nothing is compared."""
        at = self.layout.channel
        order = np.array([len(c.ar) for c in self.channels])
        ar = np.zeros((len(self.channels), max(order)))
        for own, noise in zip(ar, self.channels, strict=True):
            own[: len(noise.ar)] = noise.ar
        sd = np.array([c.innovation_sd for c in self.channels])
        found = whitened(
            np.ascontiguousarray(columns, dtype=float),
            self.seen,
            self.layout.ends,
            self.layout.slot,
            ar[at],
            order[at],
            sd[at],
        )
        found *= np.sqrt(self.weight)[:, None]
        return found


def tolerances(samples: Samples) -> Floats:
    """What is small in each channel (c,): its sensor's scatter and practical floor together.

    Raises:
        ValueError: a channel has neither.
    """
    found = np.array([np.hypot(c.noise_sd, c.floor) for c in samples.channels])
    if np.any(~(found > 0.0)):
        name = samples.channels[int(np.argmin(found > 0.0))].name
        raise ValueError(f"channel {name}: noise_sd or floor should be above zero, both are not")
    return found


def estimate_noise(
    residual: Floats, samples: Samples, found: Layout, orders: Sequence[int] | None = None
) -> Noise:
    """Noise whose realisation ``residual`` (n,) could be; NaN where nothing is compared.

    ``orders`` (c,) of the autoregressions; None: Schwarz's criterion chooses.
    """
    seen = np.isfinite(residual)
    tolerance = tolerances(samples)
    count = len(samples.channels)
    seen_sd = robust_sds(residual, seen, samples.channel, count, _LARGEST)
    scale = np.maximum(seen_sd, 0.05 * tolerance)
    standard = np.clip(residual / scale[samples.channel], -_LARGEST, _LARGEST)
    order = _largest_order(found, seen) if orders is None else max(orders)
    moments, counts = lagged_products(
        standard, seen, found.ends, found.slot, found.channel, count, int(order)
    )
    channels = _fitted(moments, counts, samples.channels, scale, orders)
    plain = Noise(found, channels, seen, np.ones(len(residual)))
    new = np.abs(plain.whiten(np.where(seen, residual, 0.0)[:, None])[:, 0])
    weight = np.minimum(1.0, _LARGEST / np.maximum(new, _LARGEST))
    return Noise(found, channels, seen, weight)


def _largest_order(found: Layout, seen: NDArray[np.bool_]) -> int:
    most = int(found.counts(seen).max())
    return max(order for order in _ORDERS if order == 0 or order <= most // 20)


def _fitted(
    moments: Floats,
    counts: Floats,
    channels: Sequence[Channel],
    scale: Floats,
    orders: Sequence[int] | None,
) -> tuple[ChannelNoise, ...]:
    """Least-squares autoregressions of all channels from their ``moments`` (c, p+1, p+1) in units
    of ``scale`` (c,), of the ``orders`` (c,) given or of those that Schwarz's criterion chooses."""
    moment, count, few = _lent(moments, counts, channels)
    every = np.arange(len(channels))
    best, least = np.full(len(channels), np.inf), np.ones(len(channels))
    chosen = np.zeros((len(channels), moments.shape[1] - 1))
    length = np.zeros(len(channels), dtype=np.int64)
    for order in sorted(set(_ORDERS if orders is None else orders)):
        if order >= moments.shape[1]:
            break
        tried = every if orders is None else every[np.asarray(orders) == order]
        own = moment[tried]
        past = slice(1, order + 1)
        ar = np.linalg.solve(own[:, past, past], own[:, past, :1])[:, :, 0]
        left = own[:, 0, 0] - np.einsum("cp,cp->c", own[:, 0, past], ar)
        criterion = count[tried] * np.log(np.maximum(left, 1e-12)) + order * np.log(count[tried])
        better = criterion < best[tried]
        at = tried[better]
        best[at], least[at], length[at] = criterion[better], left[better], order
        chosen[at] = 0.0
        chosen[at, :order] = ar[better]
    innovation_sd = np.sqrt(np.maximum(least, 1e-12))
    return tuple(
        ChannelNoise(float(scale[c]), np.zeros(0), float(scale[c]))
        if few[c]
        else ChannelNoise(
            float(scale[c]),
            tamed(chosen[c, : length[c]], float(innovation_sd[c]), _WILDEST, _FINELY),
            float(innovation_sd[c] * scale[c]),
        )
        for c in every
    )


def _lent(
    moments: Floats, counts: Floats, channels: Sequence[Channel]
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Mean moments of each channel with what the others of its sensor lend it, of how many samples
    (c,) they are, and where there are too few of the whole sensor to tell anything (c,)."""
    sensors = np.array([channel.sensor for channel in channels])
    moment, count = moments.copy(), counts.copy()
    few = np.zeros(len(channels), bool)
    for sensor in np.unique(sensors):
        own = sensors == sensor
        shared = float(counts[own].sum())
        few[own] = shared < _FEWEST
        borrowed = min(_SHARED, shared)
        moment[own] += borrowed * moments[own].sum(axis=0) / max(shared, 1.0)
        count[own] += borrowed
    count = np.maximum(count, 1.0)
    return moment / count[:, None, None] + 1e-9 * np.eye(moments.shape[1]), count, few
