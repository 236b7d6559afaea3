"""DiagnoseMismatch asks who is to blame before attachments are changed."""

from __future__ import annotations

import pytest
from py_trees.common import Status

from defras_bt.diagnosis.mismatch.nodes import DiagnoseMismatch
from defras_bt.executive.reasons import Code
from defras_bt.executive.testing import flat_cloud_m
from defras_sim.worlds.protocol import PointCloud


@pytest.fixture
def node(bench):
    """Warning state 1, with one shape seen since the grasp."""
    grip = bench.hold()
    tips = {"psm1": grip.grasp_tip}
    bench.keyframes.add(0.0, tips, tips, PointCloud(0.0, flat_cloud_m()))
    bench.warn(1)
    return bench.node(DiagnoseMismatch)


@pytest.mark.parametrize("cause", ["grasp", "camera", "arm"])
def test_who_is_to_blame_is_remembered_and_told(bench, node, cause):
    bench.mismatch.cause = cause
    assert bench.tick(node) == Status.SUCCESS
    assert node.code == "diagnosed"
    assert bench.board.mismatch.cause == cause
    assert bench.told("diagnosis") == [f"What does not fit was found: the {cause} did it."]
    assert bench.board.events[-1].data["cause"] == cause


def test_attachments_are_told_of_by_those_who_learn_them(bench, node):
    assert bench.tick(node) == Status.SUCCESS
    assert bench.board.mismatch.cause == "attachments"
    assert bench.told("diagnosis") == []


def test_the_ranking_gets_the_present_belief_and_the_shapes(bench, node):
    bench.tick(node)
    ((belief, frames),) = bench.mismatch.asked
    assert belief is bench.twin.scene
    assert [frame.stamp_s for frame in frames] == [0.0]
    assert bench.mismatch.estimator is bench.estimator


def test_the_attempt_is_remembered_so_that_it_is_not_repeated_at_once(bench, node):
    bench.tick(node)
    assert (bench.board.last_learning.tick, bench.board.last_learning.warning_state) == (0, 1)


def test_it_does_not_run_against_what_it_cannot_mend(bench, node):
    bench.fails(Code.STALE)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "would_not_help"
    assert bench.mismatch.asked == []


def test_a_finding_ends_with_its_grip(bench, node):
    bench.mismatch.cause = "grasp"
    bench.tick(node)
    bench.world.tools["psm1"].grasped = False
    bench.grip_tracker.update(bench.world.observe())
    assert bench.board.mismatch is None


def test_it_never_commands(bench, node):
    bench.tick(node)
    assert bench.board.command.arms == {}
