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

from defras_bt.diagnosis.columns import Option
from defras_bt.diagnosis.held_out import Bounded, Products, fitted_losses, losses, products
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import ChannelNoise, Noise, estimate_noise
from defras_bt.diagnosis.problem import Integers, Samples
from defras_bt.diagnosis.ranking import Board, alike, bounds_of, score, whitened_products
from defras_sim.geometry import Floats

_SHORT_LIST = 4
_PAIRS = 2
_MOST = 8
_APART = 0.2
"""Cosine below which two candidates have nothing to do with each other."""


Chosen = tuple[tuple[str, int], ...]
"""Candidates by key, each with the number of one of its options."""


@dataclass(frozen=True)
class Beside:
    """``noise`` and the ``remainder`` (n,) that it was estimated from: the residual less
    nuisances and candidates ``removed``."""

    noise: Noise
    remainder: Floats
    removed: Chosen

    def columns_of(self, board: Board) -> list[tuple[Option, Integers]]:
        """What was removed, on a board."""
        return [board.of_option[key][option] for key, option in self.removed]


def noise_beside(
    residual: Floats, board: Board, samples: Samples, found: Layout, removed: Chosen = ()
) -> Beside:
    """Noise beside the candidates of ``board`` that ``residual`` (n,) most likely holds, added one
    or two at a time to those that are known to be ``removed``."""
    first = estimate_noise(residual, samples, found)
    removed = tuple(one for one in removed if one[0] in board.of_option)
    best = _without(residual, board, samples, found, first, removed)
    for _ in range(_MOST):
        noise, gone = best.noise, best.removed
        promising, inner = _promising(best, board)
        tried = [
            _without(residual, board, samples, found, noise, (*gone, *more)) for more in promising
        ]
        tried = sorted((one for one in tried if _cost(one) < _cost(best)), key=_cost)
        if not tried:
            break
        best = tried[0]
        # What else was good and concerns other numbers may come along.
        more = best.removed
        for one in tried[1:]:
            new = one.removed[len(gone) :]
            here = [key for key, _ in more]
            if len(new) == 1 and all(alike(board, inner, new[0][0], k) < _APART for k in here):
                more = (*more, *new)
        if len(more) > len(best.removed):
            both = _without(residual, board, samples, found, noise, more)
            best = min(best, both, key=_cost)
    return best


def _promising(best: Beside, board: Board) -> tuple[list[Chosen], Products]:
    """Single candidates and pairs that explain most of a remainder; inner products of it."""
    gone = {*board.nuisance, *(key for key, _ in best.removed)}
    chosen: dict[Chosen, None] = {}
    for weighing in (_white(best.noise), best.noise):
        inner = whitened_products(board, weighing, np.nan_to_num(best.remainder)[:, None])
        scores = score(board, inner)
        order = sorted(scores.best, key=lambda key: -float(scores.statistic(key)[0]))
        order = [key for key in order if board.of_option[key] and key not in gone]
        order = order[:_SHORT_LIST]
        for key in order:
            chosen.setdefault(((key, int(scores.option[key][0])),))
        chosen |= dict.fromkeys(_pairs(board, inner, order))
    return list(chosen), inner


def _pairs(board: Board, inner: Products, keys: Sequence[str]) -> list[Chosen]:
    """The few pairs of ``keys`` that leave least, each with the options that do."""
    found = []
    for first, second in combinations(keys, 2):
        null = np.concatenate([board.always, *_nuisances(board, (first, second))])
        choices = [
            (
                float(fitted_losses(inner, np.concatenate((null, one, other)))[0]),
                ((first, i), (second, j)),
            )
            for i, (_, one) in enumerate(board.of_option[first])
            for j, (_, other) in enumerate(board.of_option[second])
        ]
        found.append(min(choices))
    return [chosen for _, chosen in sorted(found)[:_PAIRS]]


def _nuisances(board: Board, without: Sequence[str]) -> list[Integers]:
    return [own for name, own in board.nuisance.items() if name not in without]


def _without(
    residual: Floats,
    board: Board,
    samples: Samples,
    found: Layout,
    noise: Noise,
    chosen: Chosen,
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
    return Beside(noise, left, chosen)


def _cost(beside: Beside) -> float:
    """Twice the negative logarithm of the likelihood, and Schwarz's price of a candidate."""
    noise = beside.noise
    innovation_sd = np.array([c.innovation_sd for c in noise.channels])[noise.layout.channel]
    new = noise.whiten(np.nan_to_num(beside.remainder)[:, None])
    total = 2.0 * float(noise.layout.counts(noise.seen) @ np.log(innovation_sd))
    total += float((new**2).sum())
    return total + len(beside.removed) * np.log(max(int(noise.seen.sum()), 2))


def _white(noise: Noise) -> Noise:
    """The same scatter without autocorrelation: by it what is constant counts for most."""
    channels = tuple(ChannelNoise(c.sd, np.zeros(0), c.sd) for c in noise.channels)
    return replace(noise, channels=channels)
