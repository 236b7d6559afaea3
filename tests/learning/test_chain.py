"""Networks propose, the model refines, held-out points decide: with the shipped weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from defras_bt.learning.chain.chain import ChainEstimator, pooled
from defras_bt.learning.chain.estimators import ESTIMATORS, estimator
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.networks.estimator import NetworkEstimator
from defras_bt.learning.networks.propose import Proposal
from defras_bt.learning.prediction import Predicted
from defras_sim.scene import Scene

Record = Callable[[int], list[Keyframe]]


class Says:
    """A network that says what a test wants."""

    name = "test"

    def __init__(self, probability: np.ndarray | None) -> None:
        self.probability = probability
        self.predicted: list[Predicted] = []

    def propose(
        self, belief: Scene, keyframes: Sequence[Keyframe], predicted: Predicted
    ) -> Proposal | None:
        self.predicted.append(predicted)
        if self.probability is None:
            return None
        return Proposal(self.probability, np.zeros(len(self.probability)))


def chain(says: Says, belief: Scene, frames: list[Keyframe], seed: int = 0) -> AttachmentEstimate:
    return ChainEstimator((says,)).estimate(belief, frames, np.random.default_rng(seed))


def sure(attached: np.ndarray, doubt: float = 0.05) -> np.ndarray:
    return np.where(attached, 1 - doubt, doubt)


@pytest.mark.parametrize("belief_name", ["belief_without_patch", "belief_with_another_patch"])
def test_the_shipped_chain_corrects_a_wrong_patch(
    belief_name: str, truth: Scene, record: Record, request: pytest.FixtureRequest
) -> None:
    belief: Scene = request.getfixturevalue(belief_name)
    found = estimator("chain").estimate(belief, record(1), np.random.default_rng(0))
    assert found.adopted, found.reason
    assert found.held_out_after_m < 0.8 * found.held_out_before_m
    wrong, changed = belief.attached != truth.attached, found.attached != belief.attached
    assert np.sum(wrong & changed) >= 0.5 * np.sum(changed)


def test_a_right_belief_is_kept_whatever_a_network_says(truth: Scene, record: Record) -> None:
    other = truth.attached.copy()
    other[60:64] ^= True
    found = chain(Says(sure(other)), truth, record(2))
    assert not found.adopted
    np.testing.assert_array_equal(found.attached, truth.attached)


def test_a_right_proposal_is_adopted_and_a_wrong_one_refined(
    belief_without_patch: Scene, truth: Scene, record: Record
) -> None:
    frames = record(1)
    right = chain(Says(sure(truth.attached)), belief_without_patch, frames)
    assert right.adopted, right.reason
    half = truth.attached.copy()
    half[np.flatnonzero(truth.attached & ~belief_without_patch.attached)[:4]] = False
    refined = chain(Says(sure(half)), belief_without_patch, frames)
    assert refined.adopted, refined.reason
    assert refined.held_out_after_m < 1.2 * right.held_out_after_m


def test_where_a_network_leads_astray_the_search_begins_without_it(
    belief_without_patch: Scene, truth: Scene, record: Record
) -> None:
    """It is sure of everything that is wrong, so that no hole of the patch is open to question."""
    elsewhere = belief_without_patch.attached.copy()
    elsewhere[-30:-26] ^= True
    says = Says(np.where(elsewhere, 1.0 - 1e-6, 1e-6))
    led = ChainEstimator((says,), enough_m=float("inf"))
    astray = led.estimate(belief_without_patch, record(1), np.random.default_rng(0))
    found = chain(says, belief_without_patch, record(1))
    assert found.adopted, found.reason
    assert not astray.adopted or found.held_out_after_m < astray.held_out_after_m
    wrong = belief_without_patch.attached != truth.attached
    assert np.sum(wrong & (found.attached != belief_without_patch.attached)) >= 3


def test_opinions_are_pooled_by_their_odds() -> None:
    odds = np.array([[1.0, 9.0, 4.0, 1e9], [4.0, 1.0, 4.0, 1e9]])
    is_hole = np.array([True, True, False, True])
    found = pooled(odds / (1.0 + odds), is_hole)
    assert found[:2] == pytest.approx([2.0 / 3.0, 3.0 / 4.0])
    assert found[2] == 0.0
    assert found[3] < 1.0
    alone = np.array([0.3, 0.7, 0.0, 0.5])
    assert pooled([alone], is_hole) == pytest.approx(alone)


def test_without_a_proposal_it_is_the_inverse_estimate(
    belief_without_patch: Scene, record: Record
) -> None:
    says = Says(None)
    found = chain(says, belief_without_patch, record(1))
    assert found.adopted
    assert len(says.predicted[0].surfaces) == len(record(1))


def test_a_shifted_camera_is_not_blamed_on_attachments(truth: Scene, record: Record) -> None:
    shift = np.array([0.0, 0.0, 0.004])
    frames = [replace(frame, cloud_m=frame.cloud_m + shift) for frame in record(5)]
    found = estimator("chain").estimate(truth, frames, np.random.default_rng(0))
    assert not found.adopted
    assert "attachments" in found.reason


def test_a_network_alone_is_believed_if_points_agree_better(
    belief_without_patch: Scene, truth: Scene, record: Record
) -> None:
    rng = np.random.default_rng(0)
    right = NetworkEstimator(Says(sure(truth.attached)))
    assert right.estimate(belief_without_patch, record(1), rng).adopted
    wrong = truth.attached.copy()
    wrong[60:64] ^= True
    found = NetworkEstimator(Says(sure(wrong))).estimate(truth, record(1), rng)
    assert not found.adopted
    np.testing.assert_array_equal(found.attached, truth.attached)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_answers_where_there_is_nothing_to_learn_from(
    name: str, truth: Scene, record: Record
) -> None:
    made = estimator(name)
    rng = np.random.default_rng(0)
    assert "no shape was observed" in made.estimate(truth, [], rng).reason
    assert "not been moved far enough" in made.estimate(truth, record(1)[:1], rng).reason


@pytest.mark.parametrize("name", ["banet", "sequence", "chain"])
def test_one_seed_gives_one_answer(name: str, belief_without_patch: Scene, record: Record) -> None:
    one, other = (
        estimator(name).estimate(belief_without_patch, record(1), np.random.default_rng(3))
        for _ in range(2)
    )
    np.testing.assert_array_equal(one.attached, other.attached)
    np.testing.assert_array_equal(one.probability, other.probability)
    assert one.reason == other.reason
