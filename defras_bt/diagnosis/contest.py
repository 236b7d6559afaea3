"""Full fits of candidates against each other, and what they have to reach to be accepted."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.diagnosis import Round, Trial
from defras_bt.diagnosis.excess import is_practical
from defras_bt.diagnosis.fitted import Fit, bare, conflicts
from defras_bt.diagnosis.fitting import Addition, extend, walked, without
from defras_bt.diagnosis.held_out import Products, losses
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.noise_search import Beside
from defras_bt.diagnosis.ranking import Board, bounds_of, score, start_of
from defras_bt.diagnosis.search import Search

_CLEARLY = 2.0
"""Of the threshold, for causes that are accepted together."""


def accepted_together(
    search: Search, now: Board, found: Products, beside: Beside, limit: float
) -> bool:
    """Try all causes at once that the noise was estimated beside; whether any was accepted.

    Of causes that hide each other none is above chance alone. Each has to be so beside the others,
    and clearly, since the noise was estimated with all of them gone; one that is only just above
    chance waits for a round of its own.
    """
    limit *= _CLEARLY
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
        after = noise_after(search, {"": fit}, search.noise)
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
    search.history.append(fit)
    return True


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
    after = noise_after(search, fits, search.noise)
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


def noise_after(search: Search, fits: dict[str, Fit], noise: Noise) -> Noise:
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
