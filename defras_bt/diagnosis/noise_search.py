"""Noise of a residual that may still hold causes: estimated with the most likely ones removed.

A large cause that is still in a residual looks like slow, large noise, against which nothing is
significant, least of all the cause itself. So a few of the most promising candidates, and pairs of
them, are taken out in turn, the noise is estimated from what each leaves, and the likelihood of
everything together says which of these noises to believe.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from defras_bt.diagnosis.held_out import Bounded, losses, products
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
    listed: dict[str, int] = {}
    for weighing in (best.noise, _white(best.noise)):
        scores = score(board, whitened_products(board, weighing, np.nan_to_num(residual)[:, None]))
        order = sorted(scores.best, key=lambda key: -float(scores.statistic(key)[0]))
        for key in [k for k in order if board.of_option[k]][:_SHORT_LIST]:
            listed.setdefault(key, int(scores.option[key][0]))
    for key, option in listed.items():
        tried.append(_without(residual, board, samples, found, best.noise, ((key, option),)))
    by_likelihood = sorted(tried[1:], key=_cost)[:_SHORT_LIST]
    singles = [one.removed[0] for one in by_likelihood]
    for pair in combinations(singles, 2):
        chosen = tuple((key, listed[key]) for key in pair)
        tried.append(_without(residual, board, samples, found, best.noise, chosen))
    return min(tried, key=_cost)


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
    index += [own for name, own in board.nuisance.items() if name not in keys]
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
