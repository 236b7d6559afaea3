"""Parameters by plain squares, where these predict better than whitened ones.

Generalised least squares knows parameters best *if* the model with the named causes is true but for
noise. It trusts what changes fast, because the noise does not. Where a cause is only nearly right
(real play has no sharp corners) that is the part which is wrong, and a fit to all of the residual
predicts held-out data much better. Which of the two it is, these data themselves say.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.diagnosis import Trial
from defras_bt.diagnosis.excess import excess, excess_of_sensors
from defras_bt.diagnosis.fitted import Fit
from defras_bt.diagnosis.fitting import Addition, differentiate, extend, refine, without
from defras_bt.diagnosis.intervals import standard_errors
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.ranking import board, start_of, whitened_products
from defras_bt.diagnosis.search import Search

_ROUNDS = 3
"""Of fits, each with weights of what the last one left over."""
_CLEAR = 3.0
"""Standard errors that a nuisance should be away from its null value."""
_WIDTH = 0.1
"""Of a parameter's step, to both sides, over which its derivative is measured."""


def fit_plainly(search: Search) -> None:
    """Fit what was accepted by plain squares, and keep that if held-out data ask for it.

    The noise by which chance is judged stays autocorrelated.
    """
    if not search.fit.free:
        return
    orders = np.zeros(len(search.samples.channels), np.int64)
    fit = search.fit
    white = estimate_noise(fit.residual, search.samples, search.layout, orders.tolist())
    if not _promised(search, white):
        return
    for _ in range(_ROUNDS):
        before = fit
        fit = refine(search.counted, fit, white, iterations=search.settings.iterations)
        if fit.model == before.model:
            break
        white = estimate_noise(fit.residual, search.samples, search.layout, orders.tolist())
    now = excess(search.held_out(search.fit, search.noise).residual, search.samples)
    plain = replace(search, fit=fit, fitted_with=white)
    then = excess(plain.held_out(fit, search.noise).residual, search.samples)
    if then < (1.0 - search.settings.relative_gain) * now:
        fit = _with_fresh_derivatives(search, fit, white)
        search.fit, search.fitted_with = fit, white
        search.noise = estimate_noise(fit.residual, search.samples, search.layout)
        _drop_idle(search, white)
        _take_in_nuisances(search, white)
        search.stand()


def _promised(search: Search, white: Noise) -> bool:
    """Whether by the linearised model plain squares would predict held-out data better at all."""
    now = excess(search.held_out(search.fit, search.noise).residual, search.samples)
    plain = replace(search, fitted_with=white).held_out(search.fit, search.noise)
    return excess(plain.residual, search.samples) < now


def _with_fresh_derivatives(search: Search, fit: Fit, white: Noise) -> Fit:
    """Plain squares often end far from where whitened ones did and derivatives were known."""
    for _ in range(_ROUNDS):
        widths = np.full(len(fit.free), _WIDTH)
        fresh = differentiate(search.counted, fit, widths)
        fit = refine(search.counted, fresh, white, iterations=search.settings.iterations)
        if fit.model == fresh.model:
            break
    return fit


def _drop_idle(search: Search, white: Noise) -> None:
    """Take out causes without which no sensor's held-out excess is larger: whitened squares had
    asked for them, to mend what plain ones do not leave."""
    for key in search.accepted():
        if len(search.accepted()) < 2:
            return
        less = without(
            search.counted, search.fit, key, white, iterations=search.settings.iterations
        )
        now = _excess(search, search.fit)
        then = _excess(search, less)
        if not any(then[s] > (1.0 + search.settings.relative_gain) * now[s] for s in now):
            search.fit = less
            search.rounds.append(replace(search.rounds[-1], trials=(), accepted=None, removed=key))


def _take_in_nuisances(search: Search, white: Noise) -> None:
    """Add nuisances that plain squares ask for. Beside slow errors whitened ones see constants
    badly; here a constant counts that is several of its standard errors, which know of slowness,
    and without which a sensor's held-out excess is larger."""
    inside = search.accepted()
    for candidate in (c for c in search.sketch.candidates if c.nuisance and c.key not in inside):
        if not search.sketch.options[candidate.key]:
            continue
        now = board(search.sketch, search.fit.jacobian, search.samples.fold, [candidate.key])
        residual = np.nan_to_num(search.fit.residual)[:, None]
        option, amplitudes = start_of(
            now, whitened_products(now, white, residual), candidate.key, 0
        )
        more = extend(
            search.counted,
            search.fit,
            [Addition(candidate, option, amplitudes)],
            white,
            iterations=search.settings.iterations,
        )
        if more is None:
            continue
        errors = standard_errors(
            more.jacobian,
            more.residual,
            white,
            search.samples,
            search.settings.surrogates,
            search.rng,
        )[-len(candidate.free) :]
        values = [more.model[candidate.effect.name][p.name] / p.step for p in candidate.free]
        clear = np.any(np.abs(values) > _CLEAR * errors)
        before, after = _excess(search, search.fit), _excess(search, more)
        larger = any(before[s] > (1.0 + search.settings.relative_gain) * after[s] for s in after)
        if clear and larger:
            without_it = search.held_out(search.fit, search.noise).total
            gain = without_it / search.held_out(more, search.noise).total - 1.0
            trial = Trial(candidate.key, more.model, gain, True, more.calls)
            search.fit = more
            search.rounds.append(
                replace(search.rounds[-1], trials=(trial,), accepted=candidate.key)
            )


def _excess(search: Search, fit: Fit) -> dict[str, float]:
    return excess_of_sensors(search.held_out(fit, search.noise).residual, search.samples)
