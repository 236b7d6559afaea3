"""Fits through the twin say whether they have arrived."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.fitted import CountedProblem, Fit, added
from defras_bt.diagnosis.fitting import differentiate, refine
from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.noise import Noise, estimate_noise
from tests.diagnosis.toy_problem import ToyProblem, toy

TRUTH = {"scale": {"q1_scale": 0.6, "q2_scale": -0.4}}


def _begun(problem: ToyProblem, columns: np.ndarray | None) -> tuple[Fit, Noise]:
    """Both scales at null, with ``columns`` as derivatives, or the right ones."""
    candidates = tuple(c for c in problem.candidates if c.key in ("scale@q1", "scale@q2"))
    model = {}
    for each in candidates:
        model = added(model, each, {each.free[0].name: 0.0})
    free = tuple((each.key, each.free[0]) for each in candidates)
    right = [problem.tangents({}, each)[0].columns for each in candidates]
    known = np.concatenate(right, axis=1) if columns is None else columns
    noise = estimate_noise(problem.residual(TRUTH), problem.samples, layout(problem.samples))
    return Fit(candidates, model, free, problem.residual(model), known), noise


def test_a_fit_with_right_derivatives_arrives() -> None:
    problem = toy(np.random.default_rng(3), TRUTH, length=300)
    begun, noise = _begun(problem, None)
    fit = refine(CountedProblem(problem, {}), begun, noise, iterations=6)
    assert fit.arrived
    for name, truth in TRUTH["scale"].items():
        assert abs(fit.model["scale"][name] - truth) < 0.2


def test_a_fit_that_its_derivatives_mislead_says_so_and_arrives_with_new_ones() -> None:
    problem = toy(np.random.default_rng(3), TRUTH, length=300)
    right, noise = _begun(problem, None)
    wrong, _ = _begun(problem, -right.jacobian[:, ::-1])
    counted = CountedProblem(problem, {})
    misled = refine(counted, wrong, noise, iterations=3)
    assert not misled.arrived
    anew = refine(counted, differentiate(counted, misled, np.full(2, 0.25)), noise, iterations=6)
    assert anew.arrived
    for name, truth in TRUTH["scale"].items():
        assert abs(anew.model["scale"][name] - truth) < 0.2
