"""OperatorHolds succeeds while the operator has paused or taken over, and only then."""

import pytest
from py_trees.common import Status

from defras_bt.executive.operator_nodes import OperatorHolds
from defras_bt.executive.reasons import Code
from defras_bt.recording.operator_state import NOBODY, Mode, OperatorState


@pytest.mark.parametrize(
    ("mode", "code"), [(Mode.PAUSED, Code.PAUSED), (Mode.TAKEN_OVER, Code.TAKEN_OVER)]
)
def test_it_holds(bench, mode, code):
    bench.says["operator"] = OperatorState(mode, "an instrument is changed")
    node = bench.node(OperatorHolds)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, code)
    assert node.feedback_message == "an instrument is changed"


@pytest.mark.parametrize("operator", [NOBODY, OperatorState(Mode.STOPPED, "enough")])
def test_it_does_not_hold(bench, operator):
    bench.says["operator"] = operator
    node = bench.node(OperatorHolds)
    assert (bench.tick(node), node.code) == (Status.FAILURE, Code.PERMITTED)
