"""Where a search begins: the plain model, and the base fitted to the data."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.columns import Sketch, sketch
from defras_bt.diagnosis.fitted import CountedProblem, Fit, begin
from defras_bt.diagnosis.fitting import Addition, extend
from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.problem import Problem
from defras_bt.diagnosis.ranking import board, score, start_of, whitened_products
from defras_bt.diagnosis.search import Progress, Search
from defras_bt.diagnosis.settings import Settings


def begun(problem: Problem, settings: Settings, rng: np.random.Generator) -> Search:
    """A search that knows the plain model's residual and nothing else.

    Raises:
        ValueError: residual and samples do not fit together.
    """
    samples = problem.samples
    series = layout(samples)
    counted = CountedProblem(problem, {})
    if len(counted.plain) != len(samples.time_s):
        raise ValueError(
            f"the problem's residual has {len(counted.plain)} numbers and its samples label "
            f"{len(samples.time_s)}; there should be one label for each"
        )
    noise = estimate_noise(counted.plain, samples, series)
    empty = Sketch((), {})
    return Search(counted, samples, series, empty, settings, rng, begin(counted, {}), noise)


def fitted_base(search: Search, told: Progress) -> tuple[Fit, Noise]:
    """The model with the problem's base candidates only, and its noise."""
    problem = search.counted.problem
    base = [c for c in problem.candidates if c.base]
    at_null = sketch(problem, {}, base)
    fit, noise = search.fit, search.noise
    for candidate in base:
        told(f"fitting {candidate.key}", 0.0)
        added = start_and_extend(search, fit, noise, at_null, candidate.key)
        if added is None:
            raise ValueError(f"the twin cannot follow any value of its base {candidate.key}")
        fit = added
        noise = estimate_noise(fit.residual, search.samples, search.layout)
    return fit, noise


def start_and_extend(
    search: Search, fit: Fit, noise: Noise, candidates: Sketch, key: str
) -> Fit | None:
    """``fit`` with candidate ``key`` added, from where the linearised model puts it."""
    now = board(candidates, fit.jacobian, search.samples.fold, [key])
    if not now.of_option[key]:
        return None
    found = whitened_products(now, noise, np.nan_to_num(fit.residual)[:, None])
    option, amplitudes = start_of(now, found, key, int(score(now, found).option[key][0]))
    return extend(
        search.counted,
        fit,
        [Addition(candidates.candidate(key), option, amplitudes)],
        noise,
        iterations=search.settings.iterations,
    )
