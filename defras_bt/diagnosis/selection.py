"""Selection: forward, one cause at a time, each better than chance on data it was not fitted to.

A round ranks all candidates on the linearised model, measures on surrogates what the best of them
would reach by chance, fits the best few with the twin itself, and accepts the one that predicts
held-out folds best, if that is more than chance reaches and more than is negligible. The noise is
estimated anew in every round. At the end, causes that later ones made superfluous go.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from defras_bt.diagnosis.chance import known_noise, maxima
from defras_bt.diagnosis.columns import Sketch
from defras_bt.diagnosis.diagnosis import Ranked, RankedPair, Round, Trial
from defras_bt.diagnosis.excess import is_practical
from defras_bt.diagnosis.fitting import CountedProblem, Fit, conflicts, extend, walked, without
from defras_bt.diagnosis.held_out import Products
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.noise_bias import KnownNoise
from defras_bt.diagnosis.noise_search import noise_beside
from defras_bt.diagnosis.predicted_folds import HeldOut, hold_out
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.ranking import (
    Board,
    board,
    ranked,
    ranked_pairs,
    score,
    start_of,
    whitened_products,
)
from defras_bt.diagnosis.restarts import restart
from defras_bt.diagnosis.settings import Settings
from defras_sim.geometry import Floats

_HOPELESS = 0.5
"""Of the threshold: candidates below it on the linearised model are not fitted."""
_NOT_MUCH_WORSE = 0.3
"""Of the best candidate's statistic: those below it are not fitted either."""

_PASSES = 3
"""Over all candidates, where causes had to begin anew in between."""

Progress = Callable[[str, float], None]


@dataclass
class Search:
    """What the selection has found so far; kept up to date, so that an interrupted search can be
    reported. ``fitted_with``: as if the noise were this parameters were fitted in the end, where
    that predicts better than ``noise``."""

    counted: CountedProblem
    samples: Samples
    layout: Layout
    sketch: Sketch
    settings: Settings
    rng: np.random.Generator
    fit: Fit
    noise: Noise
    fitted_with: Noise | None = None
    fits: dict[str, dict[str, Fit]] = field(default_factory=dict)
    history: list[Fit] = field(default_factory=list)
    rounds: list[Round] = field(default_factory=list)
    ranking: tuple[Ranked, ...] = ()
    pairs: tuple[RankedPair, ...] = ()

    def accepted(self) -> tuple[str, ...]:
        """Candidates of the present model that are not base."""
        return tuple(c.key for c in self.fit.candidates if not c.base)

    def open_keys(self) -> tuple[str, ...]:
        """Candidates that could still be added, and nuisances that are not in the model."""
        return tuple(
            c.key
            for c in self.sketch.candidates
            if not c.base and not any(conflicts(c, other) for other in self.fit.candidates)
        )

    def nuisance_columns(self, *without: str) -> Floats:
        """Columns (n, k) of nuisances that are not in the model."""
        inside = {c.key for c in self.fit.candidates}
        options = self.sketch.nuisances(*without, *inside)
        size = len(self.samples.time_s)
        return np.concatenate([np.zeros((size, 0)), *[o.columns for o in options]], axis=1)

    def held_out(self, fit: Fit, noise: Noise, *without: str) -> HeldOut:
        """``fit`` with every fold predicted from the others, nuisances re-tuned."""
        columns = np.concatenate((fit.jacobian, self.nuisance_columns(*without)), axis=1)
        folds = self.samples.fold
        return hold_out(fit.residual, columns, noise, folds, len(fit.free), self.fitted_with)


def select(search: Search, told: Progress) -> None:
    """Accept causes until none is left that is better than chance."""
    for _ in range(_PASSES):
        while len(search.accepted()) < search.settings.causes:
            if not _forward(search, told):
                break
        if not restart(search, told):
            break
    _backward(search, told)


def board_of(search: Search) -> Board:
    """Candidates that are still open, beside the present model."""
    return board(search.sketch, search.fit.jacobian, search.samples.fold, search.open_keys())


def _forward(search: Search, told: Progress) -> bool:
    """One round; whether a cause was accepted."""
    if not search.open_keys():
        return False
    number = len(search.rounds) + 1
    told(f"round {number}: ranking", 0.0)
    now = board_of(search)
    beside = noise_beside(search.fit.residual, now, search.samples, search.layout)
    known = known_noise(now, beside, search.samples, search.layout, search.rng)
    found = whitened_products(now, known.middle, np.nan_to_num(search.fit.residual)[:, None])
    search.noise = known.middle
    rows = ranked(now, search.sketch, found)
    if not search.ranking:
        search.ranking = rows
        best = [row.key for row in rows[:12]]
        search.pairs = ranked_pairs(now, found, best)
    told(f"round {number}: what chance reaches", 0.2)
    limit = _threshold(search, now, known, beside.remainder)
    hopeful = _hopeful(search, _worth_naming(search, now, found, rows), limit)
    trials, fits = [], {}
    for index, row in enumerate(hopeful):
        told(f"round {number}: fitting {row.key}", 0.3 + 0.7 * index / len(hopeful))
        option = int(score(now, found).option[row.key][0])
        chosen, amplitudes = start_of(now, found, row.key, option)
        fit = extend(
            search.counted,
            search.fit,
            search.sketch.candidate(row.key),
            chosen,
            amplitudes,
            known.middle,
            iterations=search.settings.iterations,
        )
        if fit is not None:
            fits[row.key] = fit
    if not fits:
        search.rounds.append(Round((), limit, None))
        return False
    after = _noise_after(search, fits, known.middle)
    for key, fit in fits.items():
        trials.append(_trial(search, key, fit, after))
    trials.sort(key=lambda trial: -trial.held_out)
    accepted = next((t for t in trials if t.held_out > limit and t.practical), None)
    search.rounds.append(Round(tuple(trials), limit, None if accepted is None else accepted.key))
    if accepted is None:
        return False
    search.fits[accepted.key] = fits
    search.fit = fits[accepted.key]
    if len(now.of_option[accepted.key]) > 1:
        search.fit = walked(search.counted, search.fit, accepted.key, after)
    search.history.append(search.fit)
    search.noise = after
    return True


def _threshold(search: Search, now: Board, known: KnownNoise, left: Floats) -> float:
    chance = maxima(now, known, left, search.settings.surrogates, search.rng)
    return max(float(np.quantile(chance, 1.0 - search.settings.false_alarm)), 0.0)


def _worth_naming(
    search: Search, now: Board, found: Products, rows: tuple[Ranked, ...]
) -> tuple[Ranked, ...]:
    """Candidates whose change would be worth naming by the linearised model; all, where none is.

    What is clearly seen but of no practical size must not stand in the way of what is both.
    """
    scores = score(now, found)
    residual = search.fit.residual
    worth = []
    for row in rows:
        if not row.visible:
            continue
        chosen, amplitudes = start_of(now, found, row.key, int(scores.option[row.key][0]))
        change = chosen.columns @ amplitudes
        share = search.settings.relative_gain
        if is_practical(change, residual, residual - change, search.samples, share):
            worth.append(row)
    return tuple(worth) or rows


def _hopeful(search: Search, rows: tuple[Ranked, ...], limit: float) -> list[Ranked]:
    """The few candidates worth a full fit: proper ones first, nuisances where no other is."""
    enough = [row for row in rows if row.visible and row.held_out > _HOPELESS * limit]
    proper = [row for row in enough if not search.sketch.candidate(row.key).nuisance]
    chosen = proper if any(row.held_out > limit for row in proper) else enough
    if not chosen:
        return []
    best = chosen[0].held_out
    return [r for r in chosen if r.held_out > _NOT_MUCH_WORSE * best][: search.settings.tried]


def _noise_after(search: Search, fits: dict[str, Fit], noise: Noise) -> Noise:
    """Noise of the best of ``fits``, nuisances re-tuned."""
    held_out = {key: search.held_out(fit, noise, key) for key, fit in fits.items()}
    best = min(held_out, key=lambda key: held_out[key].total)
    columns = np.concatenate((fits[best].jacobian, search.nuisance_columns(best)), axis=1)
    left = fits[best].residual - columns @ held_out[best].loss.amplitudes[:, 0]
    return estimate_noise(left, search.samples, search.layout)


def _trial(search: Search, key: str, fit: Fit, noise: Noise) -> Trial:
    null, with_it = search.held_out(search.fit, noise, key), search.held_out(fit, noise, key)
    practical = is_practical(
        search.fit.residual - fit.residual,
        null.residual,
        with_it.residual,
        search.samples,
        search.settings.relative_gain,
    )
    return Trial(key, fit.model, (null.total - with_it.total) / with_it.total, practical, fit.calls)


def _backward(search: Search, told: Progress) -> None:
    """Take out causes that the others made superfluous."""
    changed = True
    while changed and len(search.accepted()) > 1:
        changed = False
        for key in search.accepted()[:-1]:
            told(f"whether {key} is still needed", 0.5)
            less = without(
                search.counted, search.fit, key, search.noise, iterations=search.settings.iterations
            )
            gain = search.held_out(less, search.noise).total / (
                search.held_out(search.fit, search.noise).total
            )
            if gain - 1.0 > search.rounds[-1].threshold:
                continue
            search.fit = less
            search.history.append(less)
            search.rounds.append(replace(search.rounds[-1], trials=(), accepted=None, removed=key))
            changed = True
            break
