"""Surrogates: residuals as chance could have made them.

They have the spectrum, the correlation across channels, and the gaps of a given residual, but the
phases of noise. The residual is whitened first, so that the ends of a short recording do not leak
into its spectrum; every Fourier coefficient takes its size from a neighbouring frequency (local
bootstrap: Paparoditis & Politis 1999) and a random phase that all channels share (Prichard &
Theiler 1994); the result is coloured again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from defras_bt.diagnosis.layout import Series
from defras_bt.diagnosis.noise import ChannelNoise, Noise
from defras_sim.geometry import Floats

_NUMBERS_AT_ONCE = 4_000_000


def surrogates(
    noise: Noise, residual: Floats, count: int, rng: np.random.Generator
) -> Iterator[Floats]:
    """``count`` surrogates of ``residual`` (n,), as columns of arrays (n, m); zero where nothing
    is compared. They come in pieces, as many at once as memory likes."""
    new = noise.whiten(np.where(noise.seen, residual, 0.0)[:, None])[:, 0]
    at_once = max(1, min(count, _NUMBERS_AT_ONCE // len(residual)))
    for start in range(0, count, at_once):
        drawn = np.zeros((len(residual), min(at_once, count - start)))
        for group in noise.layout.together:
            _draw(group, noise, new, drawn, rng)
        drawn[~noise.seen] = 0.0
        yield drawn


def _draw(
    group: Sequence[Series],
    noise: Noise,
    new: Floats,
    drawn: Floats,
    rng: np.random.Generator,
) -> None:
    """Fill the rows of one group of series that share their steps."""
    length = group[0].length
    if length < 4:
        for one in group:
            sd = noise.channels[one.channel].sd
            drawn[one.rows] = sd * rng.standard_normal((one.stop - one.start, drawn.shape[1]))
        return
    grid = np.zeros((length, len(group)))
    for index, one in enumerate(group):
        seen = noise.seen[one.rows]
        grid[one.slot[seen], index] = new[one.rows][seen]
        grid[:, index] *= np.sqrt(length / max(int(seen.sum()), 1))
    size = next_fast_len(2 * length, real=True)
    coefficients = rfft(grid, axis=0) * np.sqrt(size / length)
    last = len(coefficients) - 1
    nearest = np.rint(np.linspace(0.0, last, size // 2 + 1)).astype(np.int64)
    reach = max(3, last // 10)
    colour = np.stack([_colour(noise.channels[one.channel], size) for one in group], axis=1)
    shape = (len(nearest), drawn.shape[1])
    source = np.abs(nearest[:, None] + rng.integers(-reach, reach + 1, shape))
    source = np.clip(np.where(source > last, 2 * last - source, source), 1, last)
    turn = np.exp(2j * np.pi * rng.random(shape))
    # Of the mean only the real part counts, which has half of the power.
    turn[0] *= np.sqrt(2.0)
    for index, one in enumerate(group):
        own = coefficients[:, index][source] * turn * colour[:, index, None]
        drawn[one.rows] = irfft(own, size, axis=0)[one.slot]


def _colour(noise: ChannelNoise, size: int) -> Floats:
    """Frequency response (size // 2 + 1,) from independent innovations to this noise."""
    frequency = np.exp(-2j * np.pi * np.arange(size // 2 + 1) / size)
    past = sum((a * frequency ** (k + 1) for k, a in enumerate(noise.ar)), np.zeros(len(frequency)))
    return np.asarray(noise.innovation_sd / (1.0 - past))
