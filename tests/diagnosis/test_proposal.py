"""What is proposed where data cannot tell causes apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.motions import PlannedMotion, Strengths
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats
from tests.diagnosis.toy_problem import ToyProblem, toy, wander


@dataclass
class _Motion(ToyProblem):
    sentence: str = ""
    peak_force_n: float = 0.1


@dataclass
class _Planned(ToyProblem):
    """Two joints that went the same way, and motions in which they would not."""

    force_limit_n: float = 0.5
    asked: list[Strengths] = field(default_factory=list)

    def planned_motions(
        self, model: Extension, strengths: Strengths, rng: np.random.Generator
    ) -> Sequence[PlannedMotion]:
        assert not set(model) & {key.split("@")[0] for key in strengths}
        self.asked.append(strengths)
        way = 3.0 * wander(np.random.default_rng(1), 300, 2)
        together = np.repeat(way[:, :1], 2, axis=1)
        return [
            _Motion([together], [together], sentence="move both together", peak_force_n=0.1),
            _Motion([way], [way], sentence="move each by itself", peak_force_n=0.3),
            _Motion([3.0 * way], [way], sentence="move each far", peak_force_n=0.8),
        ]


def _copied() -> tuple[list[Floats], list[Floats]]:
    """Set-points and data of two joints that always went together, the first one scaled."""
    problem = toy(np.random.default_rng(5), {"scale": {"q1_scale": 0.6}}, channels=2)
    copied = [np.repeat(s[:, :1], 2, axis=1) for s in problem.setpoints]
    measured = [
        c + (m - s) for c, m, s in zip(copied, problem.measured, problem.setpoints, strict=True)
    ]
    return copied, measured


def _set(force_limit_n: float) -> tuple[Diagnosis, _Planned]:
    problem = _Planned(*_copied(), force_limit_n=force_limit_n)
    return diagnose(problem, np.random.default_rng(5)), problem


def test_a_set_comes_with_the_safe_motion_that_tells_its_causes_apart() -> None:
    found, problem = _set(0.5)
    assert found.verdict.verdict == "set"
    said = found.verdict.proposed_motion
    assert said is not None
    assert said.startswith("Move each by itself: ")
    assert "0.3 N" in said
    assert "0.5 N" in said
    (strengths,) = problem.asked
    assert abs(strengths["scale@q1"]["q1_scale"] - 0.6) < 0.2


def test_where_no_safe_motion_tells_them_apart_that_is_said() -> None:
    weak = _set(0.2)[0].verdict.proposed_motion
    assert weak is not None
    assert weak.startswith("None is sure to tell scale@q1, coupling@q1_from_q2 apart")
    none = _set(0.05)[0].verdict.proposed_motion
    assert none is not None
    assert "all 3 motions" in none
    assert "more force than the 0.05 N" in none


def test_a_named_cause_needs_no_further_motion() -> None:
    whole = toy(np.random.default_rng(5), {"scale": {"q1_scale": 0.6}}, channels=2)
    problem = _Planned(whole.setpoints, whole.measured)
    found = diagnose(problem, np.random.default_rng(5))
    assert found.verdict.verdict == "named"
    assert found.verdict.proposed_motion is None
    assert not problem.asked
