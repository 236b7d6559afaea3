"""Attachments are recovered where the data tell them, and left alone where they do not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.inverse import InverseEstimator
from defras_bt.learning.replay import Replay
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.seen import seen_surface
from defras_sim.scene import Scene

Record = Callable[[int], list[Keyframe]]


def estimate(belief: Scene, frames: list[Keyframe], seed: int = 0) -> AttachmentEstimate:
    return InverseEstimator().estimate(belief, frames, np.random.default_rng(seed))


def worst_place_m(scene: Scene, attached: np.ndarray, frames: list[Keyframe]) -> float:
    """The local discrepancy of the newest frame."""
    state = Replay(scene, frames).repeat(scene.hole_stiffness_n_per_m(attached))[-1]
    seen = seen_surface(state.surface, scene.depth_camera)
    return LocalMetric().measure(frames[-1].cloud_m, seen).value_m


@pytest.mark.parametrize("belief_name", ["belief_without_patch", "belief_with_another_patch"])
def test_a_wrong_patch_is_corrected(
    belief_name: str, truth: Scene, record: Record, request: pytest.FixtureRequest
) -> None:
    belief: Scene = request.getfixturevalue(belief_name)
    frames = record(1)
    assert worst_place_m(belief, belief.attached, frames) > 0.004
    found = estimate(belief, frames)
    assert found.adopted, found.reason
    assert worst_place_m(belief, found.attached, frames) < 0.002
    assert found.held_out_after_m < 0.8 * found.held_out_before_m
    wrong, changed = belief.attached != truth.attached, found.attached != belief.attached
    assert np.sum(wrong & changed) >= 0.5 * np.sum(changed)
    assert np.all((found.probability >= 0) & (found.probability <= 1))


@pytest.mark.parametrize("seed", [2, 3])
def test_a_right_belief_is_kept(truth: Scene, record: Record, seed: int) -> None:
    found = estimate(truth, record(seed))
    assert not found.adopted
    np.testing.assert_array_equal(found.attached, truth.attached)
    # The camera's noise of 0.5 mm, smoothed, and what the two meshes differ by.
    assert 0.0001 < found.held_out_before_m < 0.0006


def test_a_shifted_camera_is_not_blamed_on_attachments(truth: Scene, record: Record) -> None:
    shift = np.array([0.0, 0.0, 0.004])
    frames = [replace(frame, cloud_m=frame.cloud_m + shift) for frame in record(5)]
    found = estimate(truth, frames)
    assert not found.adopted
    assert "attachments" in found.reason


def test_unobservable_holes_stay_as_believed_and_a_seed_repeats_itself(
    belief_without_patch: Scene, record: Record
) -> None:
    belief = belief_without_patch.attached.copy()
    far = belief_without_patch.holes_xy_m[:, 0] < -0.05
    belief[far] = False  # wrong, at the side opposite to the pull: nobody can see that
    scene = belief_without_patch.with_attached(belief)
    one, other = (estimate(scene, record(1), 7) for _ in range(2))
    assert one.adopted
    np.testing.assert_array_equal(one.attached[far], belief[far])
    np.testing.assert_array_equal(one.attached, other.attached)
    np.testing.assert_array_equal(one.probability, other.probability)
    assert one.held_out_after_m == other.held_out_after_m


def test_too_little_motion_and_no_frames_change_nothing(truth: Scene, record: Record) -> None:
    assert "no shape was observed" in estimate(truth, []).reason
    found = estimate(truth, record(1)[:1])
    assert not found.adopted
    assert "not been moved far enough" in found.reason


def test_a_motion_that_the_model_cannot_repeat_changes_nothing(
    truth: Scene, record: Record
) -> None:
    frames = record(1)
    beside = {"psm1": frames[0].grasp_tips["psm1"].moved(np.array([0.0, 0.0, 0.05]))}
    found = estimate(truth, [replace(frame, grasp_tips=beside) for frame in frames])
    assert not found.adopted
    assert "cannot be repeated" in found.reason
