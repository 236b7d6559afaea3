"""The cause of a mismatch is found among attachments, grasp, camera and arm."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from defras_bt.diagnosis.mismatch.ranking import MismatchRanking
from defras_bt.learning.chain.estimators import estimator
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_sim.geometry import Pose
from tests.diagnosis.mismatch.observed_pull import (
    FRAMES,
    GRASP,
    PATCH,
    WAY_M,
    held_scene,
    observed,
)

BACK = -WAY_M / np.linalg.norm(WAY_M)
STILL = Pose(np.zeros(3))


@dataclass
class Attachments:
    """An estimator that explains the held-out points down to ``after_m``, if it is asked, with
    ``changed`` holes otherwise than believed."""

    after_m: float = np.inf
    changed: int = 20
    asked: int = 0

    def estimate(self, belief, keyframes, rng):
        self.asked += 1
        attached = belief.attached.copy()
        attached[: self.changed] = ~attached[: self.changed]
        return AttachmentEstimate(
            attached,
            attached.astype(float),
            1.0,
            self.after_m,
            adopted=np.isfinite(self.after_m),
            reason="as the test says",
        )


def explain(frames: list[Keyframe], attachments: Attachments | None = None):
    rng, asked = np.random.default_rng(5), attachments or Attachments()
    return MismatchRanking().explain(held_scene(), frames, rng, asked)


@pytest.fixture(scope="module")
def slipped() -> list[Keyframe]:
    return observed(held_scene(), slips_m=[np.zeros(3)] * 2 + [0.008 * BACK] * 3)


def test_tissue_that_slipped_is_the_grasps_fault(slipped):
    attachments = Attachments()
    found = explain(slipped, attachments)
    assert found.cause == "grasp"
    assert "slipped in the jaw of PSM1 by" in found.sentence
    size_mm = float(found.sentence.split("by ")[1].split(" mm")[0])
    assert size_mm == pytest.approx(8.0, abs=2.0)
    assert found.after_m < 0.5 * found.before_m
    assert attachments.asked == 1


def test_attachments_are_blamed_if_they_explain_more(slipped):
    found = explain(slipped, Attachments(after_m=1e-4))
    assert found.cause == "attachments"
    assert "better than anything else" in found.sentence


def test_a_tip_that_is_elsewhere_is_the_arms_fault():
    found = explain(observed(held_scene(), slips_m=[np.array([0.0, 0.006, 0.0])] * FRAMES))
    assert found.cause == "arm"
    assert found.explained["arm"] > found.explained["camera"]


def test_arms_registered_with_an_error_took_the_tissue_elsewhere():
    off_m = np.array([0.0, 0.006, 0.0])
    found = explain(observed(held_scene(), grasp=GRASP.moved(off_m), slips_m=[off_m] * FRAMES))
    assert found.cause == "arm"
    size_mm = float(found.sentence.split("off by ")[1].split(" mm")[0])
    assert size_mm == pytest.approx(6.0, abs=1.5)


def test_a_camera_that_was_bumped_is_moved_back():
    bump = Pose(np.array([0.003, -0.002, 0.004])).moved(np.zeros(3), np.array([0.0, 0.03, 0.0]))
    found = explain(observed(held_scene(), camera_moved=[STILL] * 2 + [bump] * 3))
    assert found.cause == "camera"
    assert found.true_from_reported is not None
    corner_m = np.array([0.05, 0.05, 0.0])
    back_m = found.true_from_reported.apply(bump.apply(corner_m))
    assert np.linalg.norm(back_m - corner_m) < 0.0015


def test_a_camera_is_not_moved_while_attachments_explain_as_much():
    bump = Pose(np.array([0.003, -0.002, 0.004]))
    bumped = observed(held_scene(), camera_moved=[STILL] * 2 + [bump] * 3)
    clear = explain(bumped)
    assert clear.cause == "camera"
    found = explain(bumped, Attachments(after_m=0.95 * clear.after_m))
    assert found.cause == "unclear"
    assert found.true_from_reported is None
    assert "more has to be seen" in found.sentence


def test_few_changed_holes_need_not_be_far_better_than_a_rival():
    bump = Pose(np.array([0.003, -0.002, 0.004]))
    seen = observed(held_scene(), camera_moved=[STILL] * 2 + [bump] * 3)
    rival_m = explain(seen).after_m
    many, few = Attachments(0.95 * rival_m, changed=4), Attachments(0.95 * rival_m, changed=3)
    assert explain(seen, many).cause == "unclear"
    assert explain(seen, few).cause == "attachments"
    assert explain(seen, Attachments(1.05 * rival_m, changed=1)).cause == "camera"


@pytest.mark.parametrize("name", ["inverse", "chain"])
def test_what_attachments_did_is_nobody_elses_fault(name):
    """An arm that is off explains a part of it; the true estimators explain more."""
    frames, rng = observed(held_scene(PATCH)), np.random.default_rng(5)
    found = MismatchRanking().explain(held_scene(), frames, rng, estimator(name))
    assert found.cause == "attachments"


def test_where_nothing_is_wrong_nothing_else_is_blamed():
    found = explain(observed(held_scene()))
    assert found.cause == "attachments"


def test_without_motion_there_is_nothing_to_tell():
    frame = observed(held_scene())[0]
    found = explain([replace(frame, tips={"psm1": GRASP})])
    assert found.cause == "attachments"
    assert "not been moved far enough" in found.sentence
    assert explain([]).cause == "attachments"


def test_a_motion_that_cannot_be_repeated_blames_no_rival():
    away = Pose(np.array([0.5, 0.0, 0.0]))
    frames = [replace(frame, grasp_tips={"psm1": away}) for frame in observed(held_scene())]
    assert "cannot be repeated" in explain(frames).sentence
