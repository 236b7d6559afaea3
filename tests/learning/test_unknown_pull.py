"""An instrument that nobody knows of is not mistaken for attachments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from defras_bt.learning.adoption import AdoptionRule, distances_m
from defras_bt.learning.chain.chain import ChainEstimator
from defras_bt.learning.chain.estimators import estimator
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.hold_out import split
from defras_bt.learning.judging import Case
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.unknown_pull import best_pull
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.tissue.model import TissueModel
from tests.learning.conftest import GRASP, LIFTS_M, Record

HELD_ELSEWHERE = Pose(np.array([0.04, 0.035, 0.0]))
"""Where another instrument has the tissue, and lifts it by more than would follow."""


@pytest.fixture(scope="module")
def lifted(truth: Scene) -> list[Keyframe]:
    model = TissueModel(truth, elements_xyz=(10, 10, 1))
    model.grasp("psm1", GRASP)
    model.grasp("psm2", HELD_ELSEWHERE)
    rng = np.random.default_rng(4)
    frames = []
    for number, lift_m in enumerate(LIFTS_M):
        tips = {
            "psm1": GRASP.moved(np.array([0.0, 0.0, lift_m])),
            "psm2": HELD_ELSEWHERE.moved(np.array([0.0, 0.0, 1.5 * lift_m])),
        }
        surface = model.solve(tips).surface
        cloud_m = depth_cloud_m(truth.depth_camera, surface, RayCaster(surface), rng)
        known = {"psm1": tips["psm1"]}
        frames.append(Keyframe(float(number), {"psm1": GRASP}, known, cloud_m))
    return frames


def _left_m(belief: Scene, keyframes: Sequence[Keyframe], attached: np.ndarray) -> float:
    """Mean distance of the judging points."""
    parts = split(keyframes, 3, 0.003)
    shapes = Replay(belief, keyframes).repeat(belief.hole_stiffness_n_per_m(attached))
    return float(distances_m(belief.depth_camera, parts.judging_points_m, shapes)[0].mean())


def test_the_pull_is_found_near_the_instrument_and_explains_unfitted_points(
    truth: Scene, lifted: list[Keyframe]
) -> None:
    pull = best_pull(truth, lifted, Replay(truth, lifted), split(lifted, 3, 0.003))
    assert np.linalg.norm(pull.place_m[:2] - HELD_ELSEWHERE.position_m[:2]) < 0.02
    believed_m = _left_m(truth, lifted, truth.attached)
    # Noise is about 0.3 mm; the answer is linear and its places are 10 mm apart.
    assert np.abs(pull.residual_m).mean() < 0.5 * believed_m


def test_an_unknown_instrument_is_not_blamed_on_attachments(
    truth: Scene, lifted: list[Keyframe]
) -> None:
    estimate = estimator("chain").estimate(truth, lifted, np.random.default_rng(1))
    assert not estimate.adopted
    assert "attachments do not explain this" in estimate.reason


def test_a_change_that_helps_is_refused_where_a_pull_helps_more(
    truth: Scene, lifted: list[Keyframe]
) -> None:
    chain = estimator("chain")
    assert isinstance(chain, ChainEstimator)

    def learned(beyond_doubt: float) -> AttachmentEstimate:
        # Without its other demands the rule would take over what the search finds.
        rule = AdoptionRule(explained=0.0, worse_m=np.inf, beyond_doubt=beyond_doubt)
        rng = np.random.default_rng(2)
        return replace(chain, rule=rule).estimate(truth, lifted, rng)

    assert learned(-np.inf).adopted
    doubted = learned(0.88)
    assert not doubted.adopted
    assert "something unknown that pulls at" in doubted.reason


def test_a_right_patch_is_better_than_any_pull(
    truth: Scene, belief_without_patch: Scene, record: Record
) -> None:
    keyframes = record(5)
    case = Case.of(belief_without_patch, keyframes, split(keyframes, 3, 0.003))
    rule = AdoptionRule(beyond_doubt=np.inf)
    said = case.judged(truth.attached, truth.attached.astype(float), rule, np.random.default_rng(3))
    assert said.adopted, said.reason


def test_a_motion_that_cannot_be_repeated_is_said(truth: Scene, lifted: list[Keyframe]) -> None:
    away = Pose(np.array([0.5, 0.5, 0.0]))
    lost = [Keyframe(f.stamp_s, {"psm1": away}, f.tips, f.cloud_m) for f in lifted]
    with pytest.raises(NotRepeatable, match="grasp"):
        best_pull(truth, lost, Replay(truth, lost), split(lifted, 3, 0.003))


def test_a_frame_of_which_the_camera_saw_little_asks_for_no_force(
    truth: Scene, lifted: list[Keyframe]
) -> None:
    newest = lifted[-1]
    hidden = [*lifted[:-1], replace(newest, cloud_m=newest.cloud_m[:2])]
    pull = best_pull(truth, hidden, Replay(truth, hidden), split(hidden, 3, 0.003))
    assert np.isfinite(pull.residual_m).all()
