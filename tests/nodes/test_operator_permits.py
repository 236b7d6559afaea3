"""OperatorPermits fails while the operator stops, pauses or drives, or refused a plan."""

import pytest
from py_trees.common import Status

from defras_bt.executive.reasons import Code
from defras_bt.monitoring.guards import OperatorPermits
from defras_bt.recording.operator_state import Mode, OperatorState


def test_nobody_objects(bench):
    node = bench.node(OperatorPermits)
    assert bench.tick(node) == Status.SUCCESS
    assert node.code == Code.PERMITTED


@pytest.mark.parametrize(
    ("mode", "code"),
    [
        (Mode.STOPPED, Code.STOPPED),
        (Mode.PAUSED, Code.PAUSED),
        (Mode.TAKEN_OVER, Code.TAKEN_OVER),
    ],
)
def test_whatever_holds_the_operation_is_passed_on_in_words(bench, mode, code):
    bench.says["operator"] = OperatorState(mode, "the operator pressed the pedal")
    node = bench.node(OperatorPermits)
    assert bench.tick(node) == Status.FAILURE
    assert (node.code, node.feedback_message) == (code, "the operator pressed the pedal")


def test_a_refused_plan_forbids_motion(bench):
    bench.board.operator_refused = "the operator did not approve the plan"
    node = bench.node(OperatorPermits)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.PLAN_REFUSED)
