"""LearnAttachments believes a new set of holes only where unseen points bear it out."""

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.executive.testing import flat_cloud_m
from defras_bt.executive.tree_file import read_tree
from defras_bt.learning.networks.no_weights import NoWeights
from defras_bt.learning.nodes import LearnAttachments
from defras_sim.resources import resource
from defras_sim.worlds.protocol import PointCloud


@pytest.fixture
def learn(bench):
    """Learning in warning state 1, with one shape seen since the grasp."""
    grip = bench.hold()
    tips = {"psm1": grip.grasp_tip}
    bench.keyframes.add(0.0, tips, tips, PointCloud(0.0, flat_cloud_m()))
    bench.warn(1)
    return bench.node(LearnAttachments)


def test_what_is_borne_out_is_believed(bench, learn):
    bench.estimator.adopts = True
    bench.board.unexplained = True
    before = bench.scene.attached
    assert bench.tick(learn) == Status.SUCCESS
    assert learn.code == "adopted"
    np.testing.assert_array_equal(bench.context.scene.attached, ~before)
    assert bench.monitor.changes == 1, "monitoring still remembers the twin as it was"
    assert not bench.board.unexplained
    (sentence,) = bench.told("learning")
    assert "144 holes changed" in sentence
    assert "1.0 mm instead of 4.0 mm" in sentence
    assert bench.board.events[-1].data["adopted"] is True


def test_what_is_not_borne_out_is_rejected_and_logged(bench, learn):
    before = bench.scene.attached
    assert bench.tick(learn) == Status.FAILURE
    assert learn.code == "rejected"
    np.testing.assert_array_equal(bench.context.scene.attached, before)
    assert bench.monitor.changes == 0
    assert bench.board.unexplained
    assert bench.told("learning") == ["Attachments kept: unseen points agree no better"]
    assert bench.board.events[-1].data["adopted"] is False


@pytest.mark.parametrize("adopts", [True, False])
def test_the_attempt_is_remembered_with_state_and_tips(bench, learn, adopts):
    bench.estimator.adopts = adopts
    bench.tick(learn)
    attempt = bench.board.last_learning
    assert (attempt.tick, attempt.warning_state) == (0, 1)
    assert set(attempt.tips_m) == {"psm1", "psm2"}
    np.testing.assert_array_equal(attempt.tips_m["psm1"], bench.tip_m())


def test_the_estimator_gets_the_present_belief_and_the_shapes(bench, learn):
    bench.tick(learn)
    ((belief, frames),) = bench.estimator.asked
    assert belief is bench.twin.scene
    assert [frame.stamp_s for frame in frames] == [0.0]


def test_without_a_shape_nothing_is_tried(bench):
    bench.hold()
    node = bench.node(LearnAttachments)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "no_shapes"
    assert bench.estimator.asked == []
    assert bench.board.last_learning is None
    assert bench.board.unexplained
    assert bench.told("learning") == []
    assert bench.told("warning") == [
        "Nothing can be learned about the attachments: "
        "no shape of the tissue was seen since the grasp."
    ]
    bench.tick(node)
    assert bench.told("warning") == [], "told once, not every tick"


def test_it_never_commands(bench, learn):
    bench.tick(learn)
    assert bench.board.command.arms == {}


def test_the_estimator_is_asked_for_by_name(bench):
    asked = []
    context = replace(bench.context, estimator=lambda name: asked.append(name) or bench.estimator)
    for parameters in ({}, {"estimator": "banet"}):
        LearnAttachments("learn", context, LearnAttachments.Parameters.model_validate(parameters))
    assert asked == ["chain", "banet"]


@pytest.mark.parametrize(("tree", "wanted"), [("defras", {"chain"}), ("defras_paper", {"banet"})])
def test_each_tree_learns_with_its_estimator(tree, wanted):
    spec = read_tree(resource(f"trees/{tree}.yaml")).root
    leaves = [spec]
    found = set()
    while leaves:
        here = leaves.pop()
        leaves += here.children
        if here.node_class is LearnAttachments:
            found.add(here.options.estimator)
    assert found == wanted


def test_missing_weights_are_said_before_the_operation(bench):
    def nothing(name):
        raise NoWeights(f"the weights of {name} are not here")

    with pytest.raises(NoWeights, match="chain"):
        LearnAttachments(
            "learn",
            replace(bench.context, estimator=nothing),
            LearnAttachments.Parameters(),
        )
