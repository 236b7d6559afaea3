"""What a tick leaves: statuses, reasons passed on, and what was pre-empted."""

from __future__ import annotations

from types import SimpleNamespace

import py_trees
import pytest
from py_trees.common import Status

from defras_bt.executive.reasons import Code
from defras_bt.executive.statuses import TickedVisitor, carries_out_plans
from defras_bt.recording.record import Cause


@pytest.fixture
def ticked(load_toys, toy_context):
    """``ticked(text)`` loads a tree; each call of the result ticks it and takes a snapshot."""

    def load(text):
        tree = load_toys(text)
        board = SimpleNamespace(failure=None)
        visitor = TickedVisitor(board, tree)
        runner = py_trees.trees.BehaviourTree(tree.root)
        runner.add_visitor(visitor)

        def tick(**says):
            for name, status in says.items():
                toy_context.says[name] = [Status[status]]
            board.failure = None
            runner.tick()
            return visitor.snapshot()

        tick.tree, tick.board = tree, board
        return tick

    return load


GUARDED = """
reactive:
  children:
    - Watch: {name: guard}
    - Push: {name: push}
"""


def test_the_decider_of_a_reactive_is_the_child_that_stopped_it(ticked):
    tick = ticked(GUARDED)
    going = tick()
    assert going.decider["toy"] == "toy/push"
    assert going.cause == Cause("as_told", "push was told RUNNING", "toy/push")
    stopped = tick(guard="FAILURE")
    assert stopped.decider["toy"] == "toy/guard"
    assert stopped.message["toy"] == "guard was told FAILURE"
    assert stopped.code["toy"] == "as_told"


def test_a_preempted_node_keeps_its_last_status_and_words(ticked):
    tick = ticked(GUARDED)
    tick()
    after = tick(guard="FAILURE")
    assert after.status["toy/push"] == "", "it was not ticked"
    assert after.last_status["toy/push"] == "RUNNING"
    assert after.message["toy/push"] == "push was told RUNNING"
    assert tick().last_status["toy/push"] == "RUNNING"


def test_what_was_never_ticked_has_no_last_status(ticked):
    snapshot = ticked(GUARDED)(guard="FAILURE")
    assert "toy/push" not in snapshot.last_status
    assert snapshot.status["toy/push"] == snapshot.message["toy/push"] == ""


SELECTOR = """
reactive_selector:
  children:
    - Watch: {name: first}
    - Watch: {name: second}
"""


@pytest.mark.parametrize(
    ("first", "second", "decider"),
    [
        ("SUCCESS", "FAILURE", "first"),
        ("FAILURE", "SUCCESS", "second"),
        ("FAILURE",) * 2 + ("second",),
    ],
)
def test_the_decider_of_a_selector(ticked, first, second, decider):
    assert ticked(SELECTOR)(first=first, second=second).decider["toy"] == f"toy/{decider}"


def test_a_recovery_that_was_not_tried_decides_nothing(ticked):
    tick = ticked(SELECTOR)
    second = tick.tree.root.children[1]
    second.update = lambda: second.fail(Code.WOULD_NOT_HELP, "not tried")
    assert tick(first="FAILURE").cause.path == "toy/first"


@pytest.mark.parametrize("kind", ["invert", "ignore_failure"])
def test_a_decorator_passes_on_what_it_decorates(ticked, kind):
    snapshot = ticked(f"{kind}: {{child: {{Watch: {{name: inner}}}}}}")(inner="FAILURE")
    assert snapshot.status["toy"] == "SUCCESS"
    assert snapshot.cause == Cause("as_told", "inner was told FAILURE", "toy/inner")


WITH_PLAN = """
reactive_selector:
  children:
    - reactive:
        name: operate
        children:
          - Watch: {name: guard}
          - plan_slot: {name: act}
    - Mend: {name: mend}
"""


class TestPlans:
    """The branch that carries out plans says why it did not, while recoveries are ticked."""

    def test_it_reaches_up_to_where_alternatives_begin(self, ticked):
        tree = ticked(WITH_PLAN).tree
        assert carries_out_plans(tree.plan_slot).name == "operate"
        assert carries_out_plans(ticked(GUARDED).tree.plan_slot) is None

    def test_without_a_plan(self, ticked):
        tick = ticked(WITH_PLAN)
        snapshot = tick()
        assert snapshot.stopped_by == Cause(Code.NO_PLAN, "there is no plan", "toy/operate/act")
        assert tick.board.failure == Cause(Code.NO_PLAN, "there is no plan")
        assert snapshot.cause.path == "toy/mend"

    def test_the_guard_that_tripped_is_the_reason(self, ticked, toys, toy_context):
        tick = ticked(WITH_PLAN)
        push = toys.Push("push", toy_context, toys.Push.Parameters())
        tick.tree.plan_slot.fill([push])
        running = tick()
        assert running.stopped_by is None
        assert running.cause.path == "toy/operate/act/push"
        stopped = tick(guard="FAILURE")
        assert stopped.stopped_by.path == "toy/operate/guard"
        assert stopped.last_status["toy/operate/act/push"] == "RUNNING"
        assert tick(guard="SUCCESS").stopped_by.code == Code.PLAN_INTERRUPTED

    def test_an_action_that_fails_gives_its_own_reason(self, ticked, toys, toy_context):
        tick = ticked(WITH_PLAN)
        tick.tree.plan_slot.fill([toys.Push("push", toy_context, toys.Push.Parameters())])
        failed = tick(push="FAILURE")
        assert failed.stopped_by == Cause(
            "as_told", "push was told FAILURE", "toy/operate/act/push"
        )
