"""Parameters that no number depends on are neither moved nor said to be known."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.fitted import CountedProblem, Fit, added
from defras_bt.diagnosis.fitting import refine
from defras_bt.diagnosis.intervals import standard_errors
from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.noise import estimate_noise
from tests.diagnosis.toy_problem import toy

PROBLEM = toy(np.random.default_rng(3), {"scale": {"q1_scale": 0.6}}, length=300)
SCALE, GHOST = (
    next(c for c in PROBLEM.candidates if c.key == key) for key in ("scale@q1", "ghost")
)


def _begun() -> Fit:
    model = added(added({}, SCALE, {"q1_scale": 0.0}), GHOST, {"g": 0.0})
    (tangent,) = PROBLEM.tangents({}, SCALE)
    columns = np.concatenate([tangent.columns, np.zeros_like(tangent.columns)], axis=1)
    free = ((SCALE.key, SCALE.free[0]), (GHOST.key, GHOST.free[0]))
    return Fit((SCALE, GHOST), model, free, PROBLEM.residual(model), columns)


def test_a_parameter_that_nothing_shows_stays_where_it_is_and_may_be_anything() -> None:
    begun = _begun()
    noise = estimate_noise(begun.residual, PROBLEM.samples, layout(PROBLEM.samples))
    fit = refine(CountedProblem(PROBLEM, {}), begun, noise, iterations=6)
    assert abs(fit.model["scale"]["q1_scale"] - 0.6) < 0.2
    assert fit.model["ghost"]["g"] == 0.0
    scale, ghost = standard_errors(
        fit.jacobian, fit.residual, noise, PROBLEM.samples, 100, np.random.default_rng(0)
    )
    assert scale < 2.0
    assert ghost > 1000.0
