"""What each kind of inner node does, above all on the tick on which a guard trips."""

import py_trees
import pytest
from py_trees.common import Status

from defras_bt.executive.tree_kinds import KINDS, kind_of

S, F, R = Status.SUCCESS, Status.FAILURE, Status.RUNNING


@pytest.fixture
def tick(load_toys, toy_context):
    """``tick(text, scripts, ticks)``: what happened in each tick, and the tree's status after."""

    def run(text, scripts, ticks):
        toy_context.says.update({name: list(script) for name, script in scripts.items()})
        root = load_toys(text).root
        happened = []
        for _ in range(ticks):
            toy_context.log.clear()
            root.tick_once()
            happened.append((list(toy_context.log), root.status))
        return happened

    return run


def test_reactive_stops_the_action_in_the_tick_in_which_the_guard_trips(tick):
    first, second = tick("reactive: {children: [Watch, Push]}", {"watch": [S, F]}, 2)
    assert first == ([("watch", "SUCCESS"), ("watch", "ends SUCCESS"), ("push", "RUNNING")], R)
    # The action is ended and not updated: no motion is proposed in this tick.
    log, status = second
    assert ("push", "ends INVALID") in log
    assert not [entry for entry in log if entry == ("push", "RUNNING")]
    assert status == F


def test_reactive_also_stops_the_action_while_the_guard_is_undecided(tick):
    _, (log, status) = tick("reactive: {children: [Watch, Push]}", {"watch": [S, R]}, 2)
    assert ("push", "ends INVALID") in log
    assert ("push", "RUNNING") not in log
    assert status == R


def test_a_guard_trips_through_everything_that_stands_between(tick):
    text = """
reactive:
  children:
    - Watch
    - retry:
        attempts: 9
        child: {sequence: {children: [Think, {selector: {children: [Push]}}]}}
"""
    _, (log, status) = tick(text, {"watch": [S, F]}, 2)
    assert ("push", "ends INVALID") in log
    assert ("push", "RUNNING") not in log
    assert status == F


def test_sequence_does_not_look_at_a_finished_child_again(tick):
    ticks = tick("sequence: {children: [Think, Mend]}", {"mend": [R, S]}, 2)
    assert ("think", "SUCCESS") in ticks[0][0]
    assert ("think", "SUCCESS") not in ticks[1][0]
    assert [status for _, status in ticks] == [R, S]


def test_reactive_selector_goes_back_to_a_better_branch(tick):
    ticks = tick("reactive_selector: {children: [Think, Mend]}", {"think": [F, S], "mend": [R]}, 2)
    assert [status for _, status in ticks] == [R, S]
    assert ("mend", "ends INVALID") in ticks[1][0]
    assert ("mend", "RUNNING") not in ticks[1][0]


def test_selector_stays_with_a_running_branch(tick):
    ticks = tick("selector: {children: [Think, Mend]}", {"think": [F, S], "mend": [R]}, 2)
    assert [status for _, status in ticks] == [R, R]
    assert ("think", "SUCCESS") not in ticks[1][0]


def test_parallel_looks_again_at_what_succeeded(tick):
    """A synchronised policy, py_trees' default, would skip the guard from the second tick on."""
    text = "parallel: {succeed_when: all, children: [Think, Mend]}"
    ticks = tick(text, {"think": [S, F], "mend": [R]}, 2)
    assert ("think", "FAILURE") in ticks[1][0]
    assert ("mend", "ends INVALID") in ticks[1][0]
    assert [status for _, status in ticks] == [R, F]


def test_a_synchronised_parallel_does_not_look_again(tick):
    text = "parallel: {succeed_when: all, synchronise: true, children: [Think, Mend]}"
    ticks = tick(text, {"think": [S, F], "mend": [R]}, 2)
    assert ("think", "FAILURE") not in ticks[1][0]
    assert [status for _, status in ticks] == [R, R]


@pytest.mark.parametrize("kind", ["running_is_failure", "time_out"])
def test_what_takes_too_long_is_stopped_in_the_same_tick(tick, kind):
    options = "ticks: 1, " if kind == "time_out" else ""
    ((log, status),) = tick(f"{kind}: {{{options}child: Mend}}", {"mend": [R]}, 1)
    assert log == [("mend", "RUNNING"), ("mend", "ends INVALID")]
    assert status == F


@pytest.mark.parametrize(
    ("policy", "status"), [("all", R), ("one", S), ("[think]", S), ("[mend]", R)]
)
def test_when_parallel_succeeds(tick, policy, status):
    text = f"parallel: {{succeed_when: {policy}, children: [Think, Mend]}}"
    assert tick(text, {"mend": [R]}, 1)[0][1] == status


@pytest.mark.parametrize(
    ("text", "child", "expected"),
    [
        ("invert: {child: Think}", [R, S], [R, F]),
        ("invert: {child: Think}", [F], [S]),
        ("ignore_failure: {child: Think}", [R, F], [R, S]),
        ("ignore_failure: {child: Think}", [S], [S]),
        ("retry: {attempts: 3, child: Think}", [F, F, S], [R, R, S]),
        ("retry: {attempts: 2, child: Think}", [F, F], [R, F]),
        ("retry: {attempts: 1, child: Think}", [F], [F]),
        ("repeat: {times: 2, child: Think}", [S, R, S], [R, R, S]),
        ("repeat: {times: 2, child: Think}", [S, F], [R, F]),
        ("success_is_failure: {child: Think}", [S], [F]),
        ("success_is_running: {child: Think}", [S, F], [R, F]),
        ("failure_is_running: {child: Think}", [F, S], [R, S]),
        ("running_is_failure: {child: Think}", [R, S], [F, S]),
        ("running_is_success: {child: Think}", [R, F], [S, F]),
        ("time_out: {ticks: 3, child: Think}", [R, R, R, R], [R, R, F, R]),
        ("time_out: {ticks: 3, child: Think}", [R, S, R, R, R], [R, S, R, R, F]),
        ("time_out: {ticks: 1, child: Think}", [R, S], [F, S]),
        ("once: {child: Think}", [R, F, S, F], [R, F, S, S]),
        ("once: {until: completion, child: Think}", [R, F, S], [R, F, F]),
        ("wait_for: {status: failure, child: Think}", [R, S, F, S], [R, R, S, R]),
        ("wait_for: {status: success, child: Think}", [F, S], [R, S]),
    ],
)
def test_decorators(tick, text, child, expected):
    ticks = tick(text, {"think": child}, len(expected))
    assert [status for _, status in ticks] == expected


def test_a_slot_in_a_tree_fails_while_it_has_no_plan(tick):
    ticks = tick("reactive: {children: [Watch, plan_slot]}", {}, 2)
    assert [status for _, status in ticks] == [F, F]


@pytest.mark.parametrize("kind", list(KINDS))
def test_every_kind_is_recognised_in_the_tree(kind):
    options = {
        "parallel": {"succeed_when": "one"},
        "retry": {"attempts": 2},
        "repeat": {"times": 2},
        "time_out": {"ticks": 2},
        "wait_for": {"status": "failure"},
    }
    made = KINDS[kind].options(**options.get(kind, {}))
    children = [py_trees.behaviours.Dummy()] if KINDS[kind].holds else []
    behaviour = KINDS[kind].build("made", made, children)
    assert (behaviour.name, kind_of(behaviour)) == ("made", kind)
    assert list(behaviour.children) == children
