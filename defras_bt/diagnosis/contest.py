"""Full fits of candidates against each other, and what they have to reach to be accepted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.diagnosis.columns import Option
from defras_bt.diagnosis.diagnosis import Round, Trial
from defras_bt.diagnosis.excess import is_practical
from defras_bt.diagnosis.fitted import Fit, added, bare, conflicts, model_without
from defras_bt.diagnosis.fitting import Addition, differentiate, extend, refine, walked, without
from defras_bt.diagnosis.held_out import Loss, Products, losses
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.noise_search import Beside
from defras_bt.diagnosis.predicted_folds import HeldOut
from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.ranking import Board, bounds_of, starts_of
from defras_bt.diagnosis.search import Search
from defras_sim.geometry import Floats

_CLEARLY = 2.0
"""Of the threshold, for causes that are accepted together."""
_ALONE = 0.8
"""Of what causes explain together."""
_NEARLY_ASKED = 0.3
"""Of the step at which the twin was asked: beginnings above it are tried there as well."""
_LEADS = 2
"""How often fits follow the noise of the best of them."""
_WIDTH = 0.25
"""Of a parameter's step, to both sides, over which a derivative is measured."""


def accepted_together(
    search: Search, now: Board, found: Products, beside: Beside, limit: float
) -> bool:
    """Try all causes at once that the noise was estimated beside; whether any was accepted.

    Of causes that hide each other none is above chance alone. Each has to be so beside the others,
    and clearly, since the noise was estimated with all of them gone; one that is only just above
    chance waits for a round of its own.
    """
    limit *= _CLEARLY
    additions = _promising_together(search, now, found, beside, limit)
    if len(additions) < 2:
        return False
    fit = extend(
        search.counted, search.fit, additions, search.noise, iterations=search.settings.iterations
    )
    while fit is not None:
        after = noise_after(search, {"": fit}, search.noise)
        search.counted.foresee([model_without(fit, one.candidate.key) for one in additions])
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
    search.rounds += [Round((trial,), limit / _CLEARLY, trial.key) for trial in trials]
    search.fit, search.noise = fit, after
    search.removed = ()
    return True


_Chosen = tuple[str, Option, Integers]
"""A cause by key, one of its options, and its columns on the board."""


def _promising_together(
    search: Search, now: Board, found: Products, beside: Beside, limit: float
) -> list[Addition]:
    """Of the causes that the noise was estimated beside, those that the linearised model needs,
    beside the others: without each of them held-out loss is larger by more than ``limit``, and what
    it changes is of practical size. None where one of them alone explains nearly all: what it
    leaves is seen once it is fitted."""
    chosen: list[_Chosen] = []
    for (key, _), (option, own) in zip(beside.removed, beside.columns_of(now), strict=True):
        candidate = search.sketch.candidate(key)
        if not any(conflicts(candidate, search.sketch.candidate(other)) for other, *_ in chosen):
            chosen.append((key, option, own))
    if not chosen:
        return []
    while len(chosen) > 1:
        _, whole = _fitted(now, found, chosen)
        gains = []
        for one in chosen:
            less = [other for other in chosen if other is not one]
            gain = float(_fitted(now, found, less)[1].total[0] / whole.total[0]) - 1.0
            gains.append(gain if _is_large(search, now, found, chosen, less) else -np.inf)
        if min(gains) > limit:
            break
        del chosen[int(np.argmin(gains))]
    index, whole = _fitted(now, found, chosen)
    nothing = float(_fitted(now, found, ())[1].total[0])
    alone = min(float(_fitted(now, found, [one])[1].total[0]) for one in chosen)
    if nothing - alone > _ALONE * (nothing - float(whole.total[0])):
        return []
    amplitudes = whole.amplitudes[:, 0]
    return [
        Addition(search.sketch.candidate(key), option, amplitudes[np.searchsorted(index, own)])
        for key, option, own in chosen
    ]


def _fitted(now: Board, found: Products, chosen: Sequence[_Chosen]) -> tuple[Integers, Loss]:
    """Causes fitted together on the linearised model, with the columns that this takes."""
    index = np.unique(np.concatenate([now.null(""), *(own for *_, own in chosen)]))
    bounds = tuple(b for _, option, own in chosen for b in bounds_of(option, own))
    return index, losses(found, index, bounds)


def _is_large(
    search: Search,
    now: Board,
    found: Products,
    more: Sequence[_Chosen],
    less: Sequence[_Chosen],
) -> bool:
    """Whether what causes ``more`` explain beyond ``less`` on the linearised model is worth naming.
    What the others could do as well does not count, and neither does what they undo."""

    def left(causes: Sequence[_Chosen]) -> Floats:
        index, loss = _fitted(now, found, causes)
        return np.asarray(search.fit.residual - now.columns[:, index] @ loss.amplitudes[:, 0])

    without, with_it = left(less), left(more)
    share = search.settings.relative_gain
    return is_practical(without - with_it, without, with_it, search.samples, share)


def _needed(search: Search, fit: Fit, key: str, noise: Noise) -> Trial:
    """How much worse a fit becomes without one of its causes, the others re-tuned."""
    less = bare(search.counted, fit, key)
    return _trial(search, key, fit, noise, less)


def accepted_of(
    search: Search, now: Board, found: Products, keys: tuple[str, ...], limit: float
) -> bool:
    """Fit rivals fully, each beside what is in the model; accept the best if it is good enough."""
    fits: dict[str, Fit] = {}
    for key in keys:
        fit = extend(
            search.counted,
            search.fit,
            [_start(search, now, found, key)],
            search.noise,
            iterations=search.settings.iterations,
        )
        if fit is not None:
            fits[key] = fit
    if not fits:
        return False
    fits, after = _led_on(search, fits)
    trials = []
    for key, fit in fits.items():
        trial = _trial(search, key, fit, after)
        if trial.held_out <= limit and _fits_better(search, fit, after, limit):
            # Derivatives led along from where the fit began may be far from those where it arrived,
            # and what they make of other folds then says nothing of the fit.
            widths = np.full(len(fit.free), _WIDTH)
            fits[key] = differentiate(search.counted, fit, widths)
            trial = _trial(search, key, fits[key], after)
        trials.append(trial)
    trials.sort(key=lambda trial: -trial.held_out)
    accepted = next((t for t in trials if t.held_out > limit and t.practical), None)
    search.rounds.append(Round(tuple(trials), limit, None if accepted is None else accepted.key))
    if accepted is None:
        return False
    search.fits[accepted.key] = fits
    search.fit = fits[accepted.key]
    if len(now.of_option[accepted.key]) > 1:
        search.fit = _settled(search, accepted.key, after)
    search.noise = after
    return True


def _led_on(search: Search, fits: dict[str, Fit]) -> tuple[dict[str, Fit], Noise]:
    """Fits where the noise beside the best of them leads them, and that noise.

    What the ranking took for noise may have been the cause. Where another fit is the best by then,
    it is its noise that counts, for all of them anew.
    """
    noise = search.noise
    best = _best(search, fits, noise)
    for _ in range(_LEADS):
        left = _noise_beside(search, fits[best], noise, best)
        fits = {key: _led(search, fit, left) for key, fit in fits.items()}
        before, noise = best, left
        best = _best(search, fits, noise)
        if best == before or search.is_spent:
            break
    return fits, _noise_beside(search, fits[best], noise, best)


def _led(search: Search, fit: Fit, noise: Noise) -> Fit:
    """``fit`` from where it is; one that ends while steps promise something is misled by its
    derivatives, and gets new ones."""
    counted, rounds = search.counted, search.settings.iterations
    led = refine(counted, fit, noise, iterations=rounds)
    if led.arrived:
        return led
    fresh = differentiate(counted, led, np.full(len(led.free), _WIDTH))
    return refine(counted, fresh, noise, iterations=rounds)


def _fits_better(search: Search, fit: Fit, noise: Noise, limit: float) -> bool:
    """Whether a fit is better than the present one on the data that it was fitted to."""
    before, after = (
        float((noise.whiten(np.nan_to_num(each.residual)[:, None]) ** 2).sum())
        for each in (search.fit, fit)
    )
    return before > (1.0 + limit) * after


def _start(search: Search, now: Board, found: Products, key: str) -> Addition:
    """How a cause should begin. Far from null a linearised model is not to be trusted: a soft
    spring that pulls a little may look like a firm one that holds, and one that lets go by three
    quarters still holds. So of beginnings of different size, and of those at which the twin was
    asked to rank them, it says itself which is best."""
    candidate = search.sketch.candidate(key)
    found_starts = starts_of(now, found, key)
    starts = [Addition(candidate, option, amplitudes) for option, amplitudes in found_starts]
    if len(starts) == 1:
        return starts[0]
    starts += [
        Addition(candidate, option, np.ones(1))
        for option, amplitudes in found_starts
        if len(amplitudes) == 1 and _NEARLY_ASKED < amplitudes[0] != 1.0
    ]
    models = [added(search.fit.model, candidate, one.values(1.0)) for one in starts]
    search.counted.foresee(models)

    def loss(number: int) -> float:
        residual = search.counted.residual(models[number])
        if not np.isfinite(residual).any():
            return np.inf
        return float((search.noise.whiten(np.nan_to_num(residual)[:, None]) ** 2).sum())

    return starts[min(range(len(starts)), key=loss)]


def _settled(search: Search, key: str, noise: Noise) -> Fit:
    """The present fit, led on where the start of a cause's fit was one of several: with derivatives
    of where it is, if the problem knows them, and to and fro along what has none."""
    fit, counted = search.fit, search.counted
    if counted.derivatives(fit.model, fit.candidates):
        fresh = differentiate(counted, fit, np.full(len(fit.free), _WIDTH))
        fit = refine(counted, fresh, noise, iterations=search.settings.iterations)
    return walked(counted, fit, key, noise)


def _retuned(search: Search, fit: Fit, held_out: HeldOut, *without: str) -> Floats:
    """The residual (n,) of ``fit`` with its strengths and nuisances re-tuned."""
    columns = search.tuned_columns(fit, *without)
    return np.asarray(fit.residual - columns @ held_out.loss.amplitudes[:, 0])


def noise_after(search: Search, fits: dict[str, Fit], noise: Noise) -> Noise:
    """Noise of the best of ``fits``, nuisances re-tuned."""
    best = _best(search, fits, noise)
    return _noise_beside(search, fits[best], noise, best)


def _best(search: Search, fits: dict[str, Fit], noise: Noise) -> str:
    """Which of ``fits`` predicts held-out folds best."""
    return min(fits, key=lambda key: search.held_out(fits[key], noise, key).total)


def _noise_beside(search: Search, fit: Fit, noise: Noise, key: str) -> Noise:
    left = _retuned(search, fit, search.held_out(fit, noise, key), key)
    return estimate_noise(left, search.samples, search.layout)


def _trial(search: Search, key: str, fit: Fit, noise: Noise, less: Fit | None = None) -> Trial:
    """``fit`` beside the same without candidate ``key``, the present model if not ``less``."""
    before = search.fit if less is None else less
    null, with_it = search.held_out(before, noise, key), search.held_out(fit, noise, key)
    practical = is_practical(
        _retuned(search, before, null, key) - _retuned(search, fit, with_it, key),
        null.residual,
        with_it.residual,
        search.samples,
        search.settings.relative_gain,
    )
    return Trial(key, fit.model, (null.total - with_it.total) / with_it.total, practical, fit.calls)
