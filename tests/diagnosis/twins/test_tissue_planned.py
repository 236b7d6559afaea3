"""Retractions that nobody has made: where they go, what they show, and what force they take."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.diagnosis.motions import PlannedMotion, Planning, separating_motions
from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.diagnosis.twins.tissue import TissueProblem
from defras_bt.diagnosis.twins.tissue_candidates import tissue_candidates
from defras_bt.diagnosis.twins.tissue_planned import Planner
from defras_bt.diagnosis.twins.tissue_plans import Plan, plans
from defras_sim.prediction import predict
from defras_sim.scene import Scene
from tests.diagnosis.twins.tissue_twin_data import SCRIPT, coarse, recorded

ASKED = ("stiffness", "tool_offset", "grasp_offset")
STRENGTHS = {
    "tool_offset": {"x_m": 0.004, "y_m": 0.0, "z_m": 0.0},
    "stiffness": {"scale": 1.5},
}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return coarse()


@pytest.fixture(scope="module")
def problem(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> TissueProblem:
    run = read_recording(recorded(scene, {}, tmp_path_factory.mktemp("r") / "null.mcap"), scene)
    candidates = tuple(c for c in tissue_candidates() if c.key in ASKED)
    return TissueProblem(scene, [run], candidates, most_frames=30, to_score=True)


@pytest.fixture(scope="module")
def planned(problem: TissueProblem) -> tuple[Plan, PlannedMotion]:
    """The first plan, which lifts and holds, and what it would show."""
    assert isinstance(problem, Planning)
    plan = plans(problem.scene, problem.trajectories)[0]
    planner = Planner(problem.scene, problem.layout, problem.samples, jobs=1)
    asked = [c for c in problem.candidates if c.key in STRENGTHS]
    motion = planner.planned(plan, {}, asked, STRENGTHS, np.random.default_rng(0))
    assert motion is not None
    return plan, motion


def test_plans_go_no_farther_than_tissue_was_carried(problem: TissueProblem) -> None:
    found = plans(problem.scene, problem.trajectories)
    assert len({plan.sentence for plan in found}) == len(found) >= 5
    for plan in found:
        (arm,) = [arm for arm in plan.motion.arms.values() if arm.grasped.any()]
        taken_m = arm.position_m[np.flatnonzero(arm.grasped)[0]]
        way_m = arm.position_m[arm.grasped] - taken_m
        assert way_m[:, 2].max() == pytest.approx(SCRIPT.lift_m, abs=1e-3)
        assert way_m[:, 2].min() >= -1e-9
        assert np.linalg.norm(way_m[:, :2], axis=1).max() < SCRIPT.lift_m
        step_m = np.linalg.norm(np.diff(arm.position_m, axis=0), axis=1)
        fastest = 3.0 * problem.scene.motion.tissue_speed_m_s
        assert (step_m / np.diff(plan.motion.time_s)).max() < 1.3 * fastest


def test_a_planned_change_is_that_of_two_predictions(
    scene: Scene, problem: TissueProblem, planned: tuple[Plan, PlannedMotion]
) -> None:
    plan, motion = planned
    (name,) = [name for name, arm in plan.motion.arms.items() if arm.grasped.any()]
    stiffer = scene.extended({"stiffness": STRENGTHS["stiffness"]})
    last = np.array([len(plan.motion) - 2])
    forces = [predict(s, plan.motion, last).force_n(name)[-1] for s in (stiffer, scene)]
    (candidate,) = [c for c in motion.candidates if c.key == "stiffness"]
    secant = motion.tangents({}, candidate)[-1]
    assert secant.steps == ({"scale": pytest.approx(0.5)},)
    row = [c.name for c in motion.samples.channels].index(f"{name} force z")
    column = secant.columns[motion.samples.channel == row, 0]
    assert column[-1] == pytest.approx((forces[0] - forces[1])[2], rel=0.02)
    # The largest force of all that may be true counts, not that of the plain model.
    assert motion.peak_force_n >= 0.99 * np.linalg.norm(forces[0])


def test_the_scenes_threshold_forbids(
    problem: TissueProblem, planned: tuple[Plan, PlannedMotion]
) -> None:
    motion = planned[1]
    assert 0.0 < problem.force_limit_n < 5.0
    (found,) = separating_motions([motion], {}, STRENGTHS, motion.peak_force_n + 1e-9)
    # Half as much force again is tens of times what a sensor of 2 mN scatters.
    assert found.separation > 10.0
    assert not separating_motions([motion], {}, STRENGTHS, 0.9 * motion.peak_force_n)
