"""The tug that tells most parts the explanations, and stays below the force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.probe.choice import (
    DIRECTIONS,
    ProbeChooser,
    ProbeRule,
    explanations_of,
    parting_m,
)
from defras_bt.learning.replay import Replay
from defras_sim.scene import Scene

Record = Callable[[int], list[Keyframe]]


@pytest.fixture(scope="module")
def frames(record: Record) -> list[Keyframe]:
    """A little of the pull, after which explanations hardly differ yet."""
    return record(1)[:2]


def test_the_tug_parts_them_as_the_model_says_and_below_the_force(
    belief_without_patch: Scene, truth: Scene, frames: list[Keyframe]
) -> None:
    both = [belief_without_patch.attached, truth.attached]
    tug = ProbeChooser().choose(belief_without_patch, frames, both, 0.3)
    assert tug is not None
    assert tug.arm == "psm1"
    assert np.linalg.norm(tug.way_m) == pytest.approx(0.006)
    assert tug.way_m[2] >= 0
    assert tug.parts_m > tug.now_m + 0.0005
    assert tug.force_n < 0.8 * 0.3
    states = []
    for attached in both:
        replay = Replay(belief_without_patch, frames)
        replay.repeat(belief_without_patch.hole_stiffness_n_per_m(attached))
        states.append(replay.displaced(len(frames) - 1, {tug.arm: tug.way_m}))
    assert all(state is not None and state.converged for state in states)
    parts_m = parting_m([s for s in states if s is not None], truth.depth_camera)
    assert parts_m == pytest.approx(tug.parts_m, abs=1e-4)


def test_a_low_threshold_forbids_every_tug(
    belief_without_patch: Scene, truth: Scene, frames: list[Keyframe]
) -> None:
    both = [belief_without_patch.attached, truth.attached]
    assert ProbeChooser().choose(belief_without_patch, frames, both, 1e-4) is None
    assert ProbeChooser().choose(belief_without_patch, frames, both, float("nan")) is None


def test_explanations_that_hardly_part_are_not_worth_a_tug(
    belief_without_patch: Scene, frames: list[Keyframe]
) -> None:
    other = belief_without_patch.attached.copy()
    other[12 * 5] ^= True  # at the clamped side, far from the pull
    both = [belief_without_patch.attached, other]
    assert ProbeChooser().choose(belief_without_patch, frames, both, 0.3) is None


def test_a_motion_that_the_model_cannot_repeat_gives_no_tug(
    belief_without_patch: Scene, truth: Scene, frames: list[Keyframe]
) -> None:
    grasp = frames[0].grasp_tips["psm1"].moved(np.array([0.0, 0.0, 0.05]))
    missed = [replace(frame, grasp_tips={"psm1": grasp}) for frame in frames]
    both = [belief_without_patch.attached, truth.attached]
    assert ProbeChooser(ProbeRule()).choose(belief_without_patch, missed, both, 0.3) is None


def test_directions_are_unit_vectors_and_none_leads_down() -> None:
    for way in DIRECTIONS:
        assert np.linalg.norm(way) == pytest.approx(1.0)
        assert way[2] >= 0


def test_explanations_are_the_belief_and_what_is_doubtful(truth: Scene) -> None:
    probability = truth.attached.astype(float)
    doubted = np.array([3, 4, 50])
    chances = np.array([0.3, 0.4, 0.5])
    probability[doubted] = np.where(truth.attached[doubted], 1 - chances, chances)
    estimate = AttachmentEstimate(truth.attached, probability, 0.0, 0.0, False, "")
    belief, all_changed, half = explanations_of(truth, estimate)
    np.testing.assert_array_equal(belief, truth.attached)
    assert np.flatnonzero(all_changed != belief).tolist() == [3, 4, 50]
    assert np.flatnonzero(half != belief).tolist() == [50]
    sure = replace(estimate, probability=truth.attached.astype(float))
    assert len(explanations_of(truth, sure)) == 1
