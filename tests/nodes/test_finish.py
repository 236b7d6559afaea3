"""Finish ends the operation at its goal."""

import pytest
from py_trees.common import Status

from defras_bt.executive.nodes import Finish
from defras_bt.executive.reasons import Code


@pytest.mark.parametrize(
    ("seen", "missing", "share"),
    [
        (0.0, (), "0%"),
        (0.79, (), "79%"),
        (None, (), "unknown"),
        (float("nan"), (), "unknown"),
        (0.95, ("the visibility of the region is 0.60 s old",), "unknown"),
    ],
)
def test_a_goal_that_nobody_sees_is_none(bench, seen, missing, share):
    """Whatever tree it stands in: a bare Finish must not claim the goal."""
    bench.world.visibility = seen
    bench.says["missing"] = missing
    node = bench.node(Finish)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.HIDDEN)
    assert f"{share} of the region is visible of 80%" in node.feedback_message
    assert bench.board.outcome is None
    assert bench.board.events == []


def test_it_decides_the_outcome_with_the_share_seen(bench):
    bench.world.visibility = 0.873
    node = bench.node(Finish)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "goal")
    assert bench.board.outcome == "goal"
    assert bench.told("goal") == ["87% of the region of interest is visible: the goal is reached."]
    assert bench.board.command.arms == {}


def test_an_earlier_outcome_stands(bench):
    bench.world.visibility = 1.0
    bench.board.end("human", "asked before", Code.ASKED)
    bench.tick(bench.node(Finish))
    assert (bench.board.outcome, bench.board.outcome_reason) == ("human", "asked before")
