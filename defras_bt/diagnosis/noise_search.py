"""Noise of a residual that may still hold causes: estimated with the most likely ones removed.

A large cause that is still in a residual looks like slow, large noise, against which nothing is
significant, least of all the cause itself. So a few of the most promising candidates, and pairs of
them, are taken out in turn, the noise is estimated from what each leaves, and the likelihood of
everything together says which of these noises to believe.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from defras_bt.diagnosis.held_out import Bounded, Products, losses, products
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import ChannelNoise, Noise, estimate_noise
from defras_bt.diagnosis.problem import Integers, Samples
from defras_bt.diagnosis.ranking import Board, bounds_of, score, whitened_products
from defras_sim.geometry import Floats

_SHORT_LIST = 4


@dataclass(frozen=True)
class Beside:
    """``noise`` and the ``remainder`` (n,) that it was estimated from: the residual less
    nuisances and candidates ``removed``."""

    noise: Noise
    remainder: Floats
    removed: tuple[str, ...]


def noise_beside(residual: Floats, board: Board, samples: Samples, found: Layout) -> Beside:
    """Noise beside the candidates of ``board`` that ``residual`` (n,) most likely holds."""
    first = estimate_noise(residual, samples, found)
    tried = [_without(residual, board, samples, found, first, ())]
    best = tried[0]
    singles: dict[str, int] = {}
    pairs: dict[tuple[tuple[str, int], ...], None] = {}
    for weighing in (best.noise, _white(best.noise)):
        inner = whitened_products(board, weighing, np.nan_to_num(residual)[:, None])
        scores = score(board, inner)
        order = sorted(scores.best, key=lambda key: -float(scores.statistic(key)[0]))
        order = [key for key in order if board.of_option[key]][:_SHORT_LIST]
        for key in order:
            singles.setdefault(key, int(scores.option[key][0]))
        pairs |= dict.fromkeys(_pairs(board, inner, order))
    for chosen in [*((single,) for single in singles.items()), *pairs]:
        tried.append(_without(residual, board, samples, found, best.noise, chosen))
    return min(tried, key=_cost)


def _pairs(board: Board, inner: Products, keys: Sequence[str]) -> list[tuple[tuple[str, int], ...]]:
    """The few pairs of ``keys`` that leave least, each with the options that do."""
    found = []
    for first, second in combinations(keys, 2):
        null = np.concatenate([board.always, *_nuisances(board, (first, second))])
        choices = [
            (
                float(losses(inner, np.concatenate((null, one, other))).fitted[0]),
                ((first, i), (second, j)),
            )
            for i, (_, one) in enumerate(board.of_option[first])
            for j, (_, other) in enumerate(board.of_option[second])
        ]
        found.append(min(choices))
    return [chosen for _, chosen in sorted(found)[:_SHORT_LIST]]


def _nuisances(board: Board, without: Sequence[str]) -> list[Integers]:
    return [own for name, own in board.nuisance.items() if name not in without]


def _without(
    residual: Floats,
    board: Board,
    samples: Samples,
    found: Layout,
    noise: Noise,
    chosen: tuple[tuple[str, int], ...],
) -> Beside:
    """Nuisances and ``chosen`` options taken out, by weights that follow from the result."""
    index: list[Integers] = [board.always]
    keys = [key for key, _ in chosen]
    index += _nuisances(board, keys)
    bounds: tuple[Bounded, ...] = ()
    for key, option in chosen:
        one, own = board.of_option[key][option]
        index.append(own)
        bounds += bounds_of(one, own)
    columns = np.concatenate(index)
    place = {int(column): at for at, column in enumerate(columns)}
    bounds = tuple(Bounded(place[b.column], b.lower, b.upper) for b in bounds)
    part, filled = board.columns[:, columns], np.nan_to_num(residual)
    left = residual
    for _ in range(2):
        inner = products(noise.whiten(part), noise.whiten(filled[:, None]), board.fold)
        amplitudes = losses(inner, np.arange(len(columns)), bounds).amplitudes[:, 0]
        left = np.where(noise.seen, filled - part @ amplitudes, np.nan)
        noise = estimate_noise(left, samples, found)
    return Beside(noise, left, tuple(keys))


def _cost(beside: Beside) -> float:
    """Twice the negative logarithm of the likelihood, and Schwarz's price of a candidate."""
    noise = beside.noise
    total = 0.0
    for one in noise.layout.series:
        seen = int(noise.seen[one.rows].sum())
        total += 2.0 * seen * np.log(noise.channels[one.channel].innovation_sd)
    new = noise.whiten(np.nan_to_num(beside.remainder)[:, None])
    total += float((new**2).sum())
    return total + len(beside.removed) * np.log(max(int(noise.seen.sum()), 2))


def _white(noise: Noise) -> Noise:
    """The same scatter without autocorrelation: by it what is constant counts for most."""
    channels = tuple(ChannelNoise(c.sd, np.zeros(0), c.sd) for c in noise.channels)
    return replace(noise, channels=channels)
