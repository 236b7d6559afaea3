"""GiveUp ends the run without the goal and says why."""

from py_trees.common import Status

from defras_bt.executive.nodes import GiveUp


def test_the_planner_s_reason_is_passed_on(bench):
    bench.board.no_plan = "every grasp point is blocked"
    node = bench.node(GiveUp)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "gave_up")
    assert (bench.board.outcome, bench.board.outcome_reason) == (
        "not_reached",
        "every grasp point is blocked",
    )
    assert bench.told("end") == ["The goal was not reached: every grasp point is blocked"]


def test_without_a_reason(bench):
    bench.tick(bench.node(GiveUp))
    assert bench.board.outcome_reason == "no plan leads to the goal any more"
