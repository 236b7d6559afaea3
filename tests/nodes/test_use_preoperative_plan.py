"""UsePreoperativePlan brings the plan made before the operation, once."""

from py_trees.common import Status

from defras_bt.executive.testing import NodeBench, plan_of
from defras_bt.planning.nodes import UsePreoperativePlan

PLAN = plan_of((2, 4), ("reach", "open", "grasp", "pull", "fold"))


def test_it_is_brought_once():
    bench = NodeBench(preoperative=PLAN)
    node = bench.node(UsePreoperativePlan)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "planned")
    assert bench.board.new_plan is PLAN
    assert bench.told("plan") == ["The plan made before the operation is used: 5 actions."]
    assert bench.told("replan") == []
    bench.board.new_plan = None
    assert (bench.tick(node), node.code) == (Status.FAILURE, "used_already")
    assert bench.board.new_plan is None


def test_there_may_be_none(bench):
    node = bench.node(UsePreoperativePlan)
    assert (bench.tick(node), node.code) == (Status.FAILURE, "nothing_prepared")
    assert not bench.board.preoperative_used


def test_the_operator_can_refuse_it():
    shown = []
    bench = NodeBench(preoperative=PLAN, approve=lambda plan: bool(shown.append(plan)))
    node = bench.node(UsePreoperativePlan)
    assert (bench.tick(node), node.code) == (Status.FAILURE, "plan_refused")
    assert shown == [PLAN]
    assert bench.board.new_plan is None
    assert "did not approve" in bench.board.operator_refused


def test_it_notes_after_which_manoeuvres_the_region_should_be_seen():
    """Or a preoperative plan that exposes nothing would leave its grasp point in use."""
    bench = NodeBench(preoperative=PLAN)
    bench.tick(bench.node(UsePreoperativePlan))
    assert bench.board.plan_exposing == ("pull", "fold")
