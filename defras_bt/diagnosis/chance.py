"""What chance reaches: the best candidate's statistic on surrogates of a residual."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.held_out import Products, losses, products
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise_bias import KnownNoise, corrected
from defras_bt.diagnosis.noise_search import Beside
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.ranking import Board, score, whitened_products
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_REFITS = 20


def known_noise(
    board: Board, beside: Beside, samples: Samples, found: Layout, rng: np.random.Generator
) -> KnownNoise:
    """Noise that was estimated beside causes, without the bias of having removed them and of having
    chosen the best."""
    noise = beside.noise
    removed = [index for _, index in beside.columns_of(board)]
    fixed = np.unique(np.concatenate([board.null(""), *removed[1:]]))

    def refit(drawn: Floats) -> Floats:
        inner = whitened_products(board, noise, drawn)
        if not removed:
            return np.asarray(drawn - board.columns[:, fixed] @ losses(inner, fixed).amplitudes)
        scores = score(board, inner)
        keys = list(scores.best)
        best = np.argmax([scores.statistic(key) for key in keys], axis=0)
        left = np.empty_like(drawn)
        for column, which in enumerate(best):
            key = keys[which]
            chosen = [own for _, own in board.of_option[key]]
            index = fixed
            if chosen:
                option = int(scores.option[key][column])
                index = np.unique(np.concatenate((fixed, chosen[option])))
            amplitudes = losses(inner.only(column), index).amplitudes[:, 0]
            left[:, column] = drawn[:, column] - board.columns[:, index] @ amplitudes
        return left

    return corrected(noise, beside.remainder, samples, found, refit, _REFITS, rng)


def maxima(
    board: Board,
    noise: KnownNoise,
    residual: Floats,
    count: int,
    rng: np.random.Generator,
    off: Floats | None = None,
) -> Floats:
    """The best candidate's statistic on each of ``count`` surrogates of ``residual`` (n,); ``off``
    (n, count): what the twin itself may be off by in each."""
    return score(board, surrogate_products(board, noise, residual, count, rng, off)).largest()


def surrogate_products(
    board: Board,
    noise: KnownNoise,
    residual: Floats,
    count: int,
    rng: np.random.Generator,
    off: Floats | None = None,
) -> Products:
    """Inner products of whitened columns and ``count`` surrogates."""
    white = noise.middle.whiten(board.columns)
    parts: list[Products] = []
    begun = 0
    shares = np.diff(np.linspace(0, count, len(noise.variants) + 1).astype(int))
    for variant, share in zip(noise.variants, shares, strict=True):
        for drawn in surrogates(variant, residual, int(share), rng):
            here = slice(begun, begun + drawn.shape[1])
            begun = here.stop
            if off is not None:
                drawn = drawn + np.where(variant.seen[:, None], off[:, here], 0.0)
            gram = parts[0].gram if parts else None
            parts.append(products(white, noise.middle.whiten(drawn), board.fold, gram))
    return Products(
        parts[0].gram,
        np.concatenate([part.cross for part in parts], axis=2),
        np.concatenate([part.square for part in parts], axis=1),
    )
