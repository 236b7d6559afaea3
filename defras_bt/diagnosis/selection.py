"""Selection: forward, one cause at a time, each better than chance on data it was not fitted to.

A round ranks all candidates on the linearised model, measures on surrogates what the best of them
would reach by chance, fits the best few with the twin itself, and accepts the one that predicts
held-out folds best, if that is more than chance reaches and more than is negligible. The noise is
estimated anew in every round. At the end, causes that later ones made superfluous go.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.chance import known_noise, maxima
from defras_bt.diagnosis.contest import accepted_of, accepted_together
from defras_bt.diagnosis.diagnosis import Round
from defras_bt.diagnosis.fitted import Fit
from defras_bt.diagnosis.fitting import refine, without
from defras_bt.diagnosis.held_out import Products
from defras_bt.diagnosis.noise_bias import KnownNoise
from defras_bt.diagnosis.noise_search import noise_beside
from defras_bt.diagnosis.problem import Approaching
from defras_bt.diagnosis.ranking import Board, ranked, ranked_pairs, whitened_products
from defras_bt.diagnosis.restarts import restart
from defras_bt.diagnosis.search import Progress, Search, board_of
from defras_bt.diagnosis.short_list import (
    contests,
    hopeful,
    nuisances,
    with_best_fitting,
    worth_naming,
)
from defras_sim.geometry import Floats

_FAR_ABOVE = 3.0
"""Of the last threshold: a best candidate above it needs no new one."""
_PASSES = 3
"""Over all candidates, where causes had to begin anew in between."""


def select(search: Search, told: Progress) -> None:
    """Accept causes until none is left that is better than chance."""
    for _ in range(_PASSES):
        while len(search.accepted()) < search.settings.causes and not search.is_spent:
            if not _forward(search, told):
                break
            _approach(search, told)
        if search.is_spent or not restart(search, told):
            break
    search.was_cut_short = search.is_spent
    _backward(search, told)


def _forward(search: Search, told: Progress) -> bool:
    """One round; whether a cause was accepted."""
    if not search.open_keys():
        return False
    number = len(search.rounds) + 1
    told(f"round {number}: ranking", 0.0)
    now = board_of(search)
    residual = search.fit.residual
    beside = noise_beside(residual, now, search.samples, search.layout, search.removed)
    search.removed = beside.removed
    known = known_noise(now, beside, search.samples, search.layout, search.rng)
    found = whitened_products(now, known.middle, np.nan_to_num(residual)[:, None])
    search.noise = known.middle
    rows = ranked(now, search.sketch, found)
    if not search.ranking:
        search.ranking = rows
        best = [row.key for row in rows[:12]]
        search.pairs = ranked_pairs(now, found, best)
    told(f"round {number}: what chance reaches", 0.2)
    limit = _threshold(search, now, known, beside.remainder, rows[0].held_out)
    if len(beside.removed) > 1 and accepted_together(search, now, found, beside, limit):
        return True
    worth = worth_naming(search, now, found, rows)
    tried = hopeful(search, worth, limit)
    groups = with_best_fitting(search, contests(now, found, tried), worth, limit)
    accepted = _contested(search, now, found, groups, limit, told)
    waiting = [row for row in nuisances(search, worth, limit) if row not in tried]
    if not accepted and waiting:
        # What is above chance and of no use may wait for a nuisance to be out of its way.
        accepted = _contested(search, now, found, contests(now, found, waiting), limit, told)
    if not groups and not waiting:
        search.rounds.append(Round((), limit, None))
    return accepted


def _approach(search: Search, told: Progress) -> None:
    """Have the twin be accurate where the model stands now, and the fit follow it."""
    told(f"what the twin gets wrong of {', '.join(search.accepted())}", 1.0)
    anew = search.counted.approach(search.fit.model)
    search.approached = isinstance(search.counted.problem, Approaching)
    if not anew:
        return
    fit = replace(search.fit, residual=search.counted.residual(search.fit.model))
    search.fit = refine(search.counted, fit, search.noise, iterations=search.settings.iterations)


def _contested(
    search: Search,
    now: Board,
    found: Products,
    groups: list[tuple[str, ...]],
    limit: float,
    told: Progress,
) -> bool:
    """Fit and judge groups of candidates in turn; whether any of them was accepted."""
    accepted = False
    for index, keys in enumerate(groups):
        if index and (len(search.accepted()) >= search.settings.causes or search.is_spent):
            break
        told(f"fitting {', '.join(keys)}", 0.3 + 0.7 * index / len(groups))
        accepted |= accepted_of(search, now, found, keys, limit)
    return accepted


def _threshold(
    search: Search, now: Board, known: KnownNoise, left: Floats, largest: float
) -> float:
    """What chance reaches. It hardly changes from round to round, so it is measured anew only
    where the best candidate is anywhere near it, or the twin is off by something else now."""
    anew, search.approached = search.approached, False
    if not anew and search.rounds and largest > _FAR_ABOVE * search.rounds[-1].threshold:
        return search.rounds[-1].threshold
    count = search.settings.surrogates
    chance = maxima(now, known, left, count, search.rng, search.approximations(count))
    return max(float(np.quantile(chance, 1.0 - search.settings.false_alarm)), 0.0)


def _without(search: Search, key: str) -> Fit:
    """The present fit less one cause, the twin being as accurate for it."""
    rounds = search.settings.iterations
    less = without(search.counted, search.fit, key, search.noise, iterations=rounds)
    if search.counted.approach(less.model):
        less = replace(less, residual=search.counted.residual(less.model))
        less = refine(search.counted, less, search.noise, iterations=rounds)
    search.stand()
    return less


def _backward(search: Search, told: Progress) -> None:
    """Take out causes that the others made superfluous, the weakest first."""
    while len(search.accepted()) > 1:
        search.stand()
        present = search.held_out(search.fit, search.noise).total
        least: tuple[float, str, Fit] | None = None
        for key in search.accepted():
            told(f"whether {key} is still needed", 0.5)
            less = _without(search, key)
            gain = search.held_out(less, search.noise).total / present - 1.0
            if least is None or gain < least[0]:
                least = gain, key, less
        if least is None or least[0] > search.rounds[-1].threshold:
            return
        _, key, search.fit = least
        search.stand()
        search.rounds.append(replace(search.rounds[-1], trials=(), accepted=None, removed=key))
