"""Scripted leaves say what they are told, and nothing else happens."""

from dataclasses import fields
from types import SimpleNamespace

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.executive.reasons import Code, Remedy, helps
from defras_bt.executive.scripted import Script, ScriptedLeaf, ScriptStep
from defras_bt.executive.testing import NodeBench


def leaf(script: Script, context: object = None) -> ScriptedLeaf:
    return ScriptedLeaf("told", context, script)


def ticked(node: ScriptedLeaf, times: int) -> list[str]:
    said = []
    for _ in range(times):
        node.tick_once()
        said.append(node.status.name)
    return said


def test_steps_are_said_one_after_the_other_and_the_last_one_stays():
    steps = (ScriptStep(status="SUCCESS", ticks=2), ScriptStep(status="FAILURE", code="broken"))
    node = leaf(Script(steps=steps))
    assert ticked(node, 4) == ["SUCCESS", "SUCCESS", "FAILURE", "FAILURE"]
    assert (node.code, node.feedback_message) == ("broken", "as the script says")


def test_steps_go_on_where_they_were_when_a_guard_pre_empts_the_leaf():
    node = leaf(Script.of("RUNNING", "RUNNING", "SUCCESS"))
    assert ticked(node, 1) == ["RUNNING"]
    node.stop(Status.INVALID)
    assert ticked(node, 2) == ["RUNNING", "SUCCESS"]


def test_a_delay_is_world_time_and_begins_again_with_every_activity():
    inputs = SimpleNamespace(time_s=0.0)
    context = SimpleNamespace(board=SimpleNamespace(inputs=inputs))
    node = leaf(Script(status="FAILURE", after_s=0.3, message="The jaw is stuck."), context)

    def until_done() -> float:
        start_s = inputs.time_s
        while node.tick_once() or node.status == Status.RUNNING:
            assert node.feedback_message == "FAILURE after 0.3 s"
            inputs.time_s += 0.1
        assert (node.status, node.feedback_message) == (Status.FAILURE, "The jaw is stuck.")
        return inputs.time_s - start_s

    assert until_done() == pytest.approx(0.3)
    inputs.time_s = 17.0
    assert until_done() == pytest.approx(0.3)


def test_a_code_of_the_project_keeps_its_remedies():
    node = leaf(Script(status="FAILURE", code="planner_timed_out"))
    node.tick_once()
    assert node.code is Code.PLANNER_TIMED_OUT
    assert not helps(Remedy.REPLAN, node.code)


def test_the_blackboard_stays_as_it_is():
    bench = NodeBench()
    board = bench.board
    before = {field.name: repr(getattr(board, field.name)) for field in fields(board)}
    for status in ("RUNNING", "SUCCESS", "FAILURE"):
        leaf(Script(status=status), bench.context).tick_once()
    assert {field.name: repr(getattr(board, field.name)) for field in fields(board)} == before


@pytest.mark.parametrize(
    ("told", "fault"),
    [
        ({}, "either steps, or one status"),
        ({"status": "SUCCESS", "steps": [{"status": "SUCCESS"}]}, "either steps, or one status"),
        ({"steps": [{"status": "SUCCESS"}], "after_s": 1}, "after_s belongs to a script with one"),
        ({"status": "INVALID"}, "'SUCCESS', 'FAILURE' or 'RUNNING'"),
        ({"status": "SUCCESS", "after_s": -1}, "greater than or equal to 0"),
        ({"steps": [{"status": "SUCCESS", "ticks": 0}]}, "greater than or equal to 1"),
        ({"status": "SUCCESS", "code": "Too Cold"}, "should match pattern"),
        ({"status": "SUCCESS", "message": ""}, "at least 1 character"),
    ],
)
def test_scripts_that_make_no_sense_are_refused(told, fault):
    with pytest.raises(ValidationError, match=fault):
        Script.model_validate(told)
