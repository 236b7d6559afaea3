"""A plan slot carries out a plan once, in order, and never falls back on an old one."""

import py_trees
import pytest
from py_trees.common import Status

from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.node import NoParameters

S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING


@pytest.fixture
def actions(toys, toy_context):
    """``actions("a", "b")`` makes motion leaves of these names."""
    return lambda *names: [toys.Push(name, toy_context, NoParameters()) for name in names]


@pytest.fixture
def slot():
    return PlanSlot("act")


def updates(context):
    return [name for name, what in context.log if not what.startswith("ends")]


def test_without_a_plan_the_slot_fails(slot):
    slot.tick_once()
    assert (slot.status, slot.code, slot.needs_plan) == (F, "no_plan", True)
    assert slot.feedback_message == "there is no plan"


def test_actions_are_carried_out_in_order(slot, actions, toy_context):
    toy_context.says.update(reach=[R, S], grasp=[S], pull=[R, S])
    slot.fill(actions("reach", "grasp", "pull"))
    assert (slot.code, slot.step, slot.needs_plan) == ("plan_ready", None, False)
    slot.tick_once()
    assert (slot.status, slot.code, slot.step) == (R, "plan_running", 0)
    assert slot.feedback_message == "step 1 of 3: reach"
    slot.tick_once()
    assert (slot.status, slot.step) == (R, 2)
    slot.tick_once()
    assert (slot.status, slot.code, slot.step) == (S, "plan_finished", None)
    assert updates(toy_context) == ["reach", "reach", "grasp", "pull", "pull"]


def test_a_finished_plan_is_not_carried_out_again(slot, actions, toy_context):
    toy_context.says.update(pull=[S])
    slot.fill(actions("pull"))
    for expected in (S, F, F):
        slot.tick_once()
        assert (slot.status, slot.code, slot.needs_plan) == (expected, "plan_finished", True)
    assert updates(toy_context) == ["pull"]


def test_a_failed_plan_says_where_and_is_not_tried_again(slot, actions, toy_context):
    toy_context.says.update(reach=[S], grasp=[F])
    slot.fill(actions("reach", "grasp", "pull"))
    for _ in range(2):
        slot.tick_once()
        assert (slot.status, slot.code) == (F, "plan_failed")
        assert slot.feedback_message == "the plan failed at grasp: grasp was told FAILURE"
    assert updates(toy_context) == ["reach", "grasp"]


def test_an_interrupted_plan_is_not_resumed_nor_restarted(slot, actions, toy_context):
    """A plain py_trees sequence would start again at step 1."""
    slot.fill(actions("reach", "pull"))
    slot.tick_once()
    slot.stop(Status.INVALID)
    assert toy_context.log[-1] == ("reach", "ends INVALID")
    slot.tick_once()
    assert (slot.status, slot.code) == (F, "plan_interrupted")
    assert slot.feedback_message == "the plan was interrupted (step 1 of 2: reach)"
    assert updates(toy_context) == ["reach"]


def test_a_new_plan_starts_at_its_first_action(slot, actions, toy_context):
    toy_context.says.update(reach=[S])
    slot.fill(actions("reach", "pull"))
    slot.tick_once()
    assert slot.step == 1
    old = list(slot.children)
    slot.fill(actions("release", "open"))
    assert toy_context.log[-1] == ("pull", "ends INVALID")
    assert [action.status for action in old] == [Status.INVALID] * 2
    assert [action.parent for action in old] == [None] * 2
    slot.tick_once()
    assert (slot.step, updates(toy_context)[-1]) == (0, "release")


def test_a_new_plan_in_the_middle_of_a_remembered_sequence(slot, actions, toy_context):
    root = py_trees.composites.Sequence("root", memory=True, children=[slot])
    slot.fill(actions("a", "b"))
    root.tick_once()
    slot.fill(actions("c", "d"))
    root.tick_once()
    assert updates(toy_context) == ["a", "c"]
    assert root.status == R


def test_clearing_ends_the_action(slot, actions, toy_context):
    slot.fill(actions("reach"))
    slot.tick_once()
    slot.clear()
    assert toy_context.log[-1] == ("reach", "ends INVALID")
    assert slot.children == []
    slot.tick_once()
    assert (slot.status, slot.code) == (F, "no_plan")


def test_a_guard_spends_the_plan_through_the_tree(load_toys, actions, toy_context):
    tree = load_toys("reactive: {children: [Watch, plan_slot]}")
    toy_context.says.update(watch=[S, F, S])
    tree.plan_slot.fill(actions("pull"))
    statuses = []
    for _ in range(3):
        tree.root.tick_once()
        statuses.append(tree.plan_slot.code)
    assert statuses == ["plan_running", "plan_interrupted", "plan_interrupted"]
    assert updates(toy_context) == ["watch", "pull", "watch", "watch"]
    tree.plan_slot.fill(actions("pull"))
    tree.root.tick_once()
    assert tree.plan_slot.code == "plan_running"


def test_unfit_plans_leave_the_slot_as_it_was(slot, actions):
    held = actions("reach")
    slot.fill(held)
    taken = actions("pull")
    PlanSlot("other").fill(taken)
    for plan, complaint in [
        ([], "to empty it, clear"),
        (actions("a", "a"), "two actions are called 'a'"),
        (actions("a/b"), "contains '/'"),
        (taken, "already under 'other'"),
    ]:
        with pytest.raises(ValueError, match=complaint):
            slot.fill(plan)
        assert slot.children == held


def test_an_action_cannot_replace_its_own_plan(slot, actions):
    (action,) = actions("pull")
    action.update = lambda: slot.fill(actions("other"))
    slot.fill([action])
    with pytest.raises(RuntimeError, match="cannot replace its own plan"):
        slot.tick_once()
    slot.fill(actions("after"))
    assert slot.code == "plan_ready"
