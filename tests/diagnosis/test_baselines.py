"""The textbooks' rules fail on autocorrelated noise: that is why the engine is not one of them."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.baselines import BASELINES, asked_of_baselines
from tests.diagnosis.toy_problem import toy


def _alarms(name: str, ar: tuple[float, ...], seeds: int = 12) -> float:
    chosen = next(one for one in BASELINES if one == name)
    problems = [toy(np.random.default_rng(s), {}, ar=ar, length=1500) for s in range(seeds)]
    return float(np.mean([asked_of_baselines(problem)[chosen].alarm for problem in problems]))


@pytest.mark.parametrize("name", ["F-test", "BIC"])
def test_significance_of_independent_samples_is_fooled_by_autocorrelation(name: str) -> None:
    assert _alarms(name, (0.97,)) >= 0.9
    assert _alarms(name, ()) <= 0.1


@pytest.mark.parametrize("name", BASELINES)
def test_all_see_a_large_cause(name: str) -> None:
    chosen = next(one for one in BASELINES if one == name)
    problem = toy(np.random.default_rng(1), {"bend": {"q1_bend": 1.0}}, ar=(0.3,), channels=1)
    found = asked_of_baselines(problem)[chosen]
    assert found.alarm
    if name in ("F-test", "BIC"):
        assert found.named == "bend@q1"
    else:
        assert found.named is None
    if name == "ridge on the residual":
        assert found.removed is not None
        assert found.removed > 0.9
