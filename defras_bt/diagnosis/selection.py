"""Selection: forward, one cause at a time, each better than chance on data it was not fitted to.

A round ranks all candidates on the linearised model, measures on surrogates what the best of them
would reach by chance, fits the best few with the twin itself, and accepts the one that predicts
held-out folds best, if that is more than chance reaches and more than is negligible. The noise is
estimated anew in every round. At the end, causes that later ones made superfluous go.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from defras_bt.diagnosis.chance import known_noise, maxima
from defras_bt.diagnosis.columns import Sketch
from defras_bt.diagnosis.diagnosis import Ranked, RankedPair, Round, Trial
from defras_bt.diagnosis.excess import is_practical
from defras_bt.diagnosis.fitting import (
    Addition,
    CountedProblem,
    Fit,
    bare,
    conflicts,
    extend,
    walked,
    without,
)
from defras_bt.diagnosis.held_out import Products, losses
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.noise_bias import KnownNoise
from defras_bt.diagnosis.noise_search import Beside, Chosen, noise_beside
from defras_bt.diagnosis.predicted_folds import HeldOut, hold_out
from defras_bt.diagnosis.problem import Samples
from defras_bt.diagnosis.ranking import (
    Board,
    alike,
    board,
    bounds_of,
    ranked,
    ranked_pairs,
    remainder,
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
"""Of the best rival's statistic: those below it are not fitted either."""
_RIVALS = 0.3
"""Cosine of what two candidates explain, from which on they are tried against each other."""
_IN_A_CONTEST, _CONTESTS = 3, 4
_FAR_ABOVE = 3.0

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
    removed: Chosen = ()
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

    def take_out(self, key: str) -> None:
        """Remove an accepted cause, and fit the others anew."""
        weighing = self.fitted_with or self.noise
        rounds = self.settings.iterations
        self.fit = without(self.counted, self.fit, key, weighing, iterations=rounds)
        self.history.append(self.fit)
        self.rounds.append(
            Round((), self.rounds[-1].threshold if self.rounds else 0.0, None, removed=key)
        )


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
    groups = contests(now, found, _hopeful(search, _worth_naming(search, now, found, rows), limit))
    accepted = False
    for index, keys in enumerate(groups):
        if index and len(search.accepted()) >= search.settings.causes:
            break
        told(f"round {number}: fitting {', '.join(keys)}", 0.3 + 0.7 * index / len(groups))
        accepted |= _contest(search, now, found, keys, limit)
    if not groups:
        search.rounds.append(Round((), limit, None))
    return accepted


def accepted_together(
    search: Search, now: Board, found: Products, beside: Beside, limit: float
) -> bool:
    """Try all causes at once that the noise was estimated beside; whether any was accepted.

    Of causes that hide each other none is above chance alone. Each has to be so beside the others.
    """
    index = np.concatenate([now.null(""), *(own for _, own in beside.columns_of(now))])
    bounds = tuple(b for option, own in beside.columns_of(now) for b in bounds_of(option, own))
    left = losses(found, index, bounds).amplitudes[len(now.null("")) :, 0]
    additions: list[Addition] = []
    for (key, _), (option, own) in zip(beside.removed, beside.columns_of(now), strict=True):
        candidate = search.sketch.candidate(key)
        if not any(conflicts(candidate, one.candidate) for one in additions):
            additions.append(Addition(candidate, option, left[: len(own)]))
        left = left[len(own) :]
    fit = extend(
        search.counted, search.fit, additions, search.noise, iterations=search.settings.iterations
    )
    while fit is not None:
        after = _noise_after(search, {"": fit}, search.noise)
        trials = [_needed(search, fit, one.candidate.key, after) for one in additions]
        weakest = min(trials, key=lambda t: t.held_out if t.practical else -np.inf)
        if weakest.held_out > limit and weakest.practical:
            break
        additions = [one for one in additions if one.candidate.key != weakest.key]
        if len(additions) < 2:
            return False
        fit = without(
            search.counted, fit, weakest.key, after, iterations=search.settings.iterations
        )
    if fit is None:
        return False
    search.rounds += [Round((trial,), limit, trial.key) for trial in trials]
    search.fit, search.noise = fit, after
    search.history.append(fit)
    return True


def _needed(search: Search, fit: Fit, key: str, noise: Noise) -> Trial:
    """How much worse a fit becomes without one of its causes, the others re-tuned."""
    less = bare(search.counted, fit, key)
    return _trial(search, key, fit, noise, less)


def _contest(
    search: Search, now: Board, found: Products, keys: tuple[str, ...], limit: float
) -> bool:
    """Fit rivals fully, each beside what is in the model; accept the best if it is good enough."""
    fits: dict[str, Fit] = {}
    for key in keys:
        option = int(score(now, found).option[key][0])
        chosen, amplitudes = start_of(now, found, key, option)
        fit = extend(
            search.counted,
            search.fit,
            [Addition(search.sketch.candidate(key), chosen, amplitudes)],
            search.noise,
            iterations=search.settings.iterations,
        )
        if fit is not None:
            fits[key] = fit
    if not fits:
        return False
    after = _noise_after(search, fits, search.noise)
    trials = [_trial(search, key, fit, after) for key, fit in fits.items()]
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


def _threshold(
    search: Search, now: Board, known: KnownNoise, left: Floats, largest: float
) -> float:
    """What chance reaches. It hardly changes from round to round, so it is measured anew only
    where the best candidate is anywhere near it."""
    if search.rounds and largest > _FAR_ABOVE * search.rounds[-1].threshold:
        return search.rounds[-1].threshold
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
        option = int(scores.option[row.key][0])
        chosen, amplitudes = start_of(now, found, row.key, option)
        change = chosen.columns @ amplitudes
        # The accepted causes make room for it, as they will when it is fitted.
        without_it = remainder(now, found, residual, None)
        with_it = remainder(now, found, residual, row.key, option)
        share = search.settings.relative_gain
        if is_practical(change, without_it, with_it, search.samples, share):
            worth.append(row)
    return tuple(worth) or rows


def _hopeful(search: Search, rows: tuple[Ranked, ...], limit: float) -> list[Ranked]:
    """The candidates worth a full fit: proper ones first, nuisances where no other is. Where
    several are above chance, those of no promise by themselves wait for the next round."""
    enough = [row for row in rows if row.visible and row.held_out > _HOPELESS * limit]
    proper = [row for row in enough if not search.sketch.candidate(row.key).nuisance]
    chosen = proper if any(row.held_out > limit for row in proper) else enough
    above = [row for row in chosen if row.held_out > limit]
    return (above or chosen)[: 2 * search.settings.tried]


def contests(now: Board, found: Products, rows: Sequence[Ranked]) -> list[tuple[str, ...]]:
    """Groups of candidates that explain much the same, the best of each first.

    Causes that have nothing to do with each other can be accepted in one round. Of a group, those
    far behind the best are left out.
    """
    groups: list[list[Ranked]] = []
    for row in rows:
        home = next((g for g in groups if alike(now, found, g[0].key, row.key) > _RIVALS), None)
        if home is None:
            groups.append([row])
        elif row.held_out > _NOT_MUCH_WORSE * home[0].held_out and len(home) < _IN_A_CONTEST:
            home.append(row)
    return [tuple(row.key for row in group) for group in groups[:_CONTESTS]]


def _noise_after(search: Search, fits: dict[str, Fit], noise: Noise) -> Noise:
    """Noise of the best of ``fits``, nuisances re-tuned."""
    held_out = {key: search.held_out(fit, noise, key) for key, fit in fits.items()}
    best = min(held_out, key=lambda key: held_out[key].total)
    columns = np.concatenate((fits[best].jacobian, search.nuisance_columns(best)), axis=1)
    left = fits[best].residual - columns @ held_out[best].loss.amplitudes[:, 0]
    return estimate_noise(left, search.samples, search.layout)


def _trial(search: Search, key: str, fit: Fit, noise: Noise, less: Fit | None = None) -> Trial:
    """``fit`` beside the same without candidate ``key``, the present model if not ``less``."""
    before = search.fit if less is None else less
    null, with_it = search.held_out(before, noise, key), search.held_out(fit, noise, key)
    practical = is_practical(
        before.residual - fit.residual,
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
        # Causes that began anew stand last, whenever they were accepted.
        newest = next((each.accepted for each in reversed(search.rounds) if each.accepted), None)
        for key in (each for each in search.accepted() if each != newest):
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
