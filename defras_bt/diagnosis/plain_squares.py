"""Parameters by plain squares, where these predict better than whitened ones.

Generalised least squares knows parameters best *if* the model with the named causes is true but for
noise. It trusts what changes fast, because the noise does not. Where a cause is only nearly right
(real play has no sharp corners) that is the part which is wrong, and a fit to all of the residual
predicts held-out data much better. Which of the two it is, these data themselves say.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.excess import excess, excess_of_sensors
from defras_bt.diagnosis.fitted import Fit
from defras_bt.diagnosis.fitting import refine, without
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.search import Search

_ROUNDS = 3
"""Of fits, each with weights of what the last one left over."""


def fit_plainly(search: Search) -> None:
    """Fit what was accepted by plain squares, and keep that if held-out data ask for it.

    The noise by which chance is judged stays autocorrelated.
    """
    if not search.fit.free:
        return
    orders = np.zeros(len(search.samples.channels), np.int64)
    fit = search.fit
    white = estimate_noise(fit.residual, search.samples, search.layout, orders.tolist())
    for _ in range(_ROUNDS):
        fit = refine(search.counted, fit, white, iterations=search.settings.iterations)
        white = estimate_noise(fit.residual, search.samples, search.layout, orders.tolist())
    now = excess(search.held_out(search.fit, search.noise).residual, search.samples)
    plain = replace(search, fit=fit, fitted_with=white)
    then = excess(plain.held_out(fit, search.noise).residual, search.samples)
    if then < (1.0 - search.settings.relative_gain) * now:
        search.fit, search.fitted_with = fit, white
        search.noise = estimate_noise(fit.residual, search.samples, search.layout)
        search.history.append(fit)
        _drop_idle(search, white)


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
            search.history.append(less)
            search.rounds.append(replace(search.rounds[-1], trials=(), accepted=None, removed=key))


def _excess(search: Search, fit: Fit) -> dict[str, float]:
    return excess_of_sensors(search.held_out(fit, search.noise).residual, search.samples)
