"""How strong each cause that was not named could still be."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from defras_bt.diagnosis.chance import known_noise, surrogate_products
from defras_bt.diagnosis.columns import Option
from defras_bt.diagnosis.held_out import losses
from defras_bt.diagnosis.noise_search import noise_beside
from defras_bt.diagnosis.problem import Candidate, Samples
from defras_bt.diagnosis.ranking import unseen, whitened_products
from defras_bt.diagnosis.search import Search, board_of
from defras_bt.diagnosis.verdict import Excluded
from defras_sim.geometry import Floats


def exclusions(search: Search) -> tuple[dict[str, Excluded], tuple[str, ...]]:
    """By candidate key: the strength that would have shown in 95 % of cases, for those within
    whose bounds there is one. Also the candidates that change nothing observable."""
    now = board_of(search)
    if not now.of_option:
        return {}, ()
    beside = noise_beside(search.fit.residual, now, search.samples, search.layout, search.removed)
    known = known_noise(now, beside, search.samples, search.layout, search.rng)
    filled = np.nan_to_num(search.fit.residual)[:, None]
    found = whitened_products(now, known.middle, filled)
    count = search.settings.surrogates
    chance = surrogate_products(
        now, known, beside.remainder, count, search.rng, search.approximations(count)
    )
    invisible = unseen(now, found)
    result: dict[str, Excluded] = {}
    for key, placed in now.of_option.items():
        if key in invisible:
            continue
        options = []
        for option, index in placed:
            columns = np.concatenate((now.null(key), index))
            own = slice(len(columns) - len(index), None)
            amplitudes = losses(found, columns).amplitudes[own, 0]
            errors = losses(chance, columns).amplitudes[own].std(axis=1)
            options.append((option, amplitudes, errors))
        strength = _strength(search.sketch.candidate(key), options, search.samples)
        if strength is not None:
            result[key] = strength
    return result, invisible


def _strength(
    candidate: Candidate, options: list[tuple[Option, Floats, Floats]], samples: Samples
) -> Excluded | None:
    strengths = [p for p in candidate.free if p.strength]
    if not strengths:
        return None
    p = strengths[0]
    best: tuple[float, float] | None = None
    for option, amplitudes, errors in options:
        for i, step in enumerate(option.tangent.steps):
            if not step.get(p.name):
                continue
            reach = abs(float(amplitudes[i])) + float(norm.ppf(0.975)) * float(errors[i])
            reach = max(reach, _practical(option.columns[:, i], samples))
            start = option.tangent.at.get(p.name, p.null) - p.null
            strength = abs(start + step[p.name] * reach)
            # A secant holds near its own strength, a tangent near a step.
            misfit = abs(float(np.log(max(reach, 1e-9))))
            if best is None or misfit < best[0]:
                best = (misfit, strength)
    if best is None or best[1] > max(p.upper - p.null, p.null - p.lower):
        return None
    return Excluded(best[1], p.unit, p.name)


def _practical(column: Floats, samples: Samples) -> float:
    """Amplitude below which a column changes no channel by more than its floor."""
    found = np.inf
    for index, channel in enumerate(samples.channels):
        rms = float(np.sqrt(np.mean(column[samples.channel == index] ** 2)))
        if rms > 0.0:
            found = min(found, channel.floor / rms)
    return found
