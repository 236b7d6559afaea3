"""Finish ends the operation at its goal."""

from py_trees.common import Status

from defras_bt.executive.nodes import Finish


def test_it_decides_the_outcome_with_the_share_seen(bench):
    bench.world.visibility = 0.873
    node = bench.node(Finish)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "goal")
    assert bench.board.outcome == "goal"
    assert bench.told("goal") == ["87% of the region of interest is visible: the goal is reached."]
    assert bench.board.command.arms == {}


def test_an_earlier_outcome_stands(bench):
    bench.board.end("human", "asked before")
    bench.tick(bench.node(Finish))
    assert (bench.board.outcome, bench.board.outcome_reason) == ("human", "asked before")
