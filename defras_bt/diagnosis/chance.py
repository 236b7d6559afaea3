"""What chance reaches: the best candidate's statistic on surrogates of a residual."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.held_out import Products, products
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise_bias import KnownNoise, corrected
from defras_bt.diagnosis.noise_search import Beside
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.ranking import Board, remainder, score, whitened_products
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_REFITS = 20


def known_noise(
    board: Board, beside: Beside, samples: Samples, found: Layout, rng: np.random.Generator
) -> KnownNoise:
    """Noise that was estimated beside the best candidates, without the bias of having chosen and
    removed them."""
    noise = beside.noise

    def refit(drawn: Floats) -> Floats:
        inner = whitened_products(board, noise, drawn)
        scores = score(board, inner)
        keys = list(scores.best)
        best = np.argmax([scores.statistic(key) for key in keys], axis=0)
        left = np.empty_like(drawn)
        for column, index in enumerate(best):
            key = keys[index]
            one = inner.only(column)
            option = int(scores.option[key][column])
            left[:, column] = remainder(board, one, drawn[:, column], key, option)
        return left

    return corrected(noise, beside.remainder, samples, found, refit, _REFITS, rng)


def maxima(
    board: Board, noise: KnownNoise, residual: Floats, count: int, rng: np.random.Generator
) -> Floats:
    """The best candidate's statistic on each of ``count`` surrogates of ``residual`` (n,)."""
    return score(board, surrogate_products(board, noise, residual, count, rng)).largest()


def surrogate_products(
    board: Board, noise: KnownNoise, residual: Floats, count: int, rng: np.random.Generator
) -> Products:
    """Inner products of whitened columns and ``count`` surrogates."""
    white = noise.middle.whiten(board.columns)
    parts = []
    shares = np.diff(np.linspace(0, count, len(noise.variants) + 1).astype(int))
    for variant, share in zip(noise.variants, shares, strict=True):
        parts += [
            products(white, noise.middle.whiten(drawn), board.fold)
            for drawn in surrogates(variant, residual, int(share), rng)
        ]
    return Products(
        parts[0].gram,
        np.concatenate([part.cross for part in parts], axis=2),
        np.concatenate([part.square for part in parts], axis=1),
    )
