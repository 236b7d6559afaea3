"""How well the parameters of named causes are known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import norm, t

from defras_bt.diagnosis.fitted import Fit
from defras_bt.diagnosis.held_out import products
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.problem import Candidate, Samples
from defras_bt.diagnosis.surrogates import surrogates
from defras_bt.diagnosis.verdict import Estimate
from defras_sim.geometry import Floats

_PRIOR_STEPS = 1e4


def standard_errors(
    columns: Floats,
    residual: Floats,
    noise: Noise,
    samples: Samples,
    count: int,
    rng: np.random.Generator,
) -> Floats:
    """Of amplitudes of ``columns`` (n, k), fitted by generalised least squares with ``residual``
    (n,) left over.

    The larger of two: the scatter over surrogates, which knows correlations in time and between
    channels, and the scatter of the folds' own pulls (sandwich: Liang & Zeger 1986), which knows
    noise that comes and goes.
    """
    white = noise.whiten(columns)
    new = noise.whiten(np.where(noise.seen, residual, 0.0)[:, None])
    found = products(white, new, samples.fold)
    gram = found.gram.sum(axis=0) + np.eye(columns.shape[1]) / _PRIOR_STEPS**2
    inverse = np.asarray(np.linalg.inv(gram))
    drawn = [
        inverse @ white.T @ noise.whiten(part) for part in surrogates(noise, residual, count, rng)
    ]
    # What no number depends on may be anything.
    unseen = np.sqrt(np.einsum("ij,ij->i", inverse, inverse)) / _PRIOR_STEPS
    by_chance = np.hypot(np.concatenate(drawn, axis=1).std(axis=1), unseen)
    pulls = found.cross[:, :, 0] @ inverse
    folds = len(pulls)
    sandwich = np.sqrt((pulls**2).sum(axis=0) * folds / max(folds - 1, 1))
    # Few folds make a poor standard error: as wide as Student's t asks for.
    sandwich *= float(t.ppf(0.95, max(folds - 1, 1)) / norm.ppf(0.95)) if folds > 1 else 0.0
    return np.asarray(np.maximum(by_chance, sandwich))


def estimates(
    fit: Fit, candidate: Candidate, errors: Floats, systematic: Mapping[str, float]
) -> dict[str, Estimate]:
    """Parameters of ``candidate`` with 90 % intervals. ``errors`` (k,) are standard errors of
    ``fit.free`` in steps; ``systematic`` standard errors by parameter, in its unit, that other
    data would not lessen (of another mesh)."""
    found = {}
    values = fit.model[candidate.effect.name]
    for (key, p), error in zip(fit.free, errors, strict=False):
        if key != candidate.key:
            continue
        reach = float(norm.ppf(0.95)) * np.hypot(error * p.step, systematic.get(p.name, 0.0))
        value = float(values[p.name])
        ends = (max(value - reach, p.lower), min(value + reach, p.upper))
        found[p.name] = Estimate(value, p.unit, (float(ends[0]), float(ends[1])))
    return found
