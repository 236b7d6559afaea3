"""WaitForOperator holds still for as long as the operator wants."""

import pytest
from py_trees.common import Status

from defras_bt.executive.operator_nodes import WaitForOperator
from defras_bt.executive.reasons import Code
from defras_bt.recording.operator_state import NOBODY, Mode, OperatorState


@pytest.mark.parametrize(
    ("mode", "until"), [(Mode.PAUSED, "resumes"), (Mode.TAKEN_OVER, "hands back")]
)
def test_it_waits_without_moving_anything(bench, mode, until):
    bench.hold()
    bench.says["operator"] = OperatorState(mode, "the operator needs time")
    node = bench.node(WaitForOperator)
    for _ in range(100):
        assert (bench.tick(node), node.code) == (Status.RUNNING, Code.OPERATOR_HOLDS)
        assert bench.board.command.arms == {}
    assert node.feedback_message.endswith(f"nothing moves until the operator {until}")
    assert "psm1" in bench.board.grips


def test_it_ends_with_the_waiting(bench):
    bench.says["operator"] = OperatorState(Mode.PAUSED, "the operator needs time")
    node = bench.node(WaitForOperator)
    bench.tick(node)
    bench.says["operator"] = NOBODY
    assert (bench.tick(node), node.code) == (Status.SUCCESS, Code.PERMITTED)
