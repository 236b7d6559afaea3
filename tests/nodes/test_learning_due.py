"""LearningDue asks for something new: a higher warning state, or a way travelled."""

import pytest
from py_trees.common import Status

from defras_bt.executive.blackboard import LearningAttempt
from defras_bt.monitoring.guards import LearningDue


@pytest.fixture
def due(bench):
    bench.hold()
    return bench.node(LearningDue, travel_m=0.005)


def tried(bench, state):
    """Learning was tried in ``state``, with the tips where they are now."""
    tips_m = {arm: bench.tip_m(arm).copy() for arm in ("psm1", "psm2")}
    bench.board.last_learning = LearningAttempt(0, state, tips_m)


def test_nothing_is_learned_from_untouched_tissue(bench):
    bench.warn(2)
    node = bench.node(LearningDue)
    assert (bench.tick(node), node.code) == (Status.FAILURE, "nothing_held")


def test_the_first_attempt_is_always_due(bench, due):
    bench.warn(1)
    assert (bench.tick(due), due.code) == (Status.SUCCESS, "due")


@pytest.mark.parametrize(("before", "now", "expected"), [(1, 1, "not_due"), (1, 2, "due")])
def test_a_higher_state_is_a_reason_and_the_same_one_is_not(bench, due, before, now, expected):
    tried(bench, before)
    bench.warn(now)
    bench.tick(due)
    assert due.code == expected


def test_a_lower_or_unknown_state_is_no_reason(bench, due):
    tried(bench, 2)
    bench.warn(1)
    assert bench.tick(due) == Status.FAILURE
    bench.warn(None)
    assert bench.tick(due) == Status.FAILURE


@pytest.mark.parametrize(("travel_m", "expected"), [(0.0049, "not_due"), (0.0051, "due")])
@pytest.mark.parametrize("arm", ["psm1", "psm2"])
def test_travel_of_either_tip_is_a_reason(bench, due, arm, travel_m, expected):
    bench.warn(1)
    tried(bench, 1)
    bench.put(arm, bench.tip_m(arm) + [0.0, 0.0, travel_m])
    bench.tick(due)
    assert due.code == expected
    assert f"{travel_m * 1e3:.1f} mm" in due.feedback_message
