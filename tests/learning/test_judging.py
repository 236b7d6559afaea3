"""Proposals on which nothing can be said are not believed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.learning.adoption import AdoptionRule
from defras_bt.learning.hold_out import split
from defras_bt.learning.judging import Case
from defras_bt.learning.networks.estimator import BETTER
from defras_sim.scene import Scene
from tests.learning.conftest import Record


@pytest.mark.parametrize("rule", [AdoptionRule(), BETTER])
def test_without_points_to_judge_by_the_belief_stays(
    truth: Scene, record: Record, rule: AdoptionRule
) -> None:
    keyframes = record(0)
    parts = split(keyframes, 3, 0.003)
    nothing = tuple(np.zeros((0, 3)) for _ in parts.judging_points_m)
    case = Case.of(truth, keyframes, replace(parts, judging_points_m=nothing))
    proposed = truth.attached.copy()
    proposed[np.flatnonzero(truth.attached)[:3]] = False
    said = case.judged(proposed, proposed.astype(float), rule, np.random.default_rng(0))
    assert not said.adopted
    assert np.array_equal(said.attached, truth.attached)
    assert "nothing of the tissue was seen" in said.reason
