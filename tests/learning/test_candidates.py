"""Which sets a proposal leads to, and which holes are asked about."""

import numpy as np
import pytest

from defras_bt.learning.chain.candidates import candidate_sets, open_questions
from defras_bt.learning.networks.propose import Proposal
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene


def said(scene: Scene, otherwise: dict[int, float], spread: float = 0.0) -> Proposal:
    """A network that agrees with the belief, but for some holes with some probability."""
    wrong = np.zeros(len(scene.attached))
    for hole, probability in otherwise.items():
        wrong[hole] = probability
    probability = np.where(scene.attached, 1.0 - wrong, wrong)
    return Proposal(probability, np.full(len(wrong), spread))


def test_holes_change_where_the_network_is_sure_enough(truth: Scene) -> None:
    proposal = said(truth, {3: 0.6, 40: 0.9})
    both, one = candidate_sets(truth, [proposal], (0.5, 0.75))
    assert np.flatnonzero(both != truth.attached).tolist() == [3, 40]
    assert np.flatnonzero(one != truth.attached).tolist() == [40]


def test_no_set_comes_twice_and_the_belief_is_none(truth: Scene) -> None:
    agreeing, doubting = said(truth, {}), said(truth, {7: 0.9})
    (only,) = candidate_sets(truth, [agreeing, doubting, doubting], (0.5, 0.75))
    assert np.flatnonzero(only != truth.attached).tolist() == [7]


@pytest.mark.parametrize("most", [1, 4, 48])
def test_the_most_doubtful_holes_are_asked_about(truth: Scene, most: int) -> None:
    proposal = said(truth, {30: 0.45, 31: 0.3, 80: 0.01})
    asked = open_questions(truth, [proposal], [], most, least=0.02)
    assert asked[30]
    assert not asked[80]
    assert asked.sum() <= max(most, 1) + 3  # equally doubtful neighbours are not told apart


def test_neighbours_of_what_a_set_changes_are_asked_about(truth: Scene) -> None:
    changed = truth.attached.copy()
    changed[66] ^= True
    asked = open_questions(truth, [said(truth, {})], [changed], 48, least=0.02)
    nx, _ = truth.hole_counts
    assert asked[[66, 65, 67, 66 - nx, 66 + nx]].all()
    assert asked.sum() == 5


def test_places_without_tissue_are_never_asked_about() -> None:
    flap = load_scene(resource("sim/scenes/flap.yaml"))
    asked = open_questions(flap, [said(flap, {30: 0.45})], [], 99, least=0.0)
    np.testing.assert_array_equal(asked, flap.is_hole)
