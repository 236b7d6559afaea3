"""AskHuman ends the run with motion zero, the grip kept, and the reason that matters most."""

import pytest
from py_trees.common import Status

from defras_bt.executive.nodes import AskHuman
from defras_bt.recording.operator_state import Mode, OperatorState

PEDAL = OperatorState(Mode.STOPPED, "the pedal is pressed")


@pytest.mark.parametrize(
    ("says", "expected"),
    [
        ({"operator": PEDAL}, "the pedal is pressed"),
        ({"operator": PEDAL, "missing": ("no cloud",)}, "the pedal is"),
        ({"missing": ("no cloud", "psm1 is 0.60 s old")}, "no cloud; psm1 is 0.60 s old"),
        ({}, "no safe way to go on was found"),
    ],
)
def test_reasons(bench, says, expected):
    bench.says.update(says)
    node = bench.node(AskHuman)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "asked")
    assert bench.board.outcome == "human"
    assert expected in bench.board.outcome_reason
    (sentence,) = bench.told("human")
    assert expected in sentence
    assert bench.board.events[-1].level == "error"


@pytest.mark.parametrize(("state", "expected"), [(1, "no safe way"), (2, "5.0 mm"), (3, "7.0 mm")])
def test_a_lost_model_is_told_in_millimetres(bench, state, expected):
    bench.warn(state)
    bench.tick(bench.node(AskHuman))
    assert expected in bench.board.outcome_reason


def test_a_refused_plan_is_a_reason(bench):
    bench.board.operator_refused = "the operator did not approve the plan"
    bench.tick(bench.node(AskHuman))
    assert bench.board.outcome_reason == "the operator did not approve the plan"


def test_the_grip_is_kept(bench):
    bench.hold()
    bench.tick(bench.node(AskHuman))
    assert bench.board.command.arms == {}
    assert "psm1" in bench.board.grips
