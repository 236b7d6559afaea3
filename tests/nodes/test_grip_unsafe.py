"""GripUnsafe says when held tissue must be let go: high force, or a mismatch nobody explains."""

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.acting.let_go import GripUnsafe
from defras_bt.executive.blackboard import LearningAttempt


def says(bench, **parameters):
    node = bench.node(GripUnsafe, **parameters)
    bench.tick(node)
    return node.status, node.code


def test_without_a_grip_nothing_is_unsafe(bench):
    bench.board.force_over_s = 9.0
    assert says(bench) == (Status.FAILURE, "nothing_held")


def test_a_grip_is_safe_until_something_speaks_against_it(bench):
    bench.hold()
    assert says(bench) == (Status.FAILURE, "safe")


@pytest.mark.parametrize(
    ("over_s", "patience_s", "expected"),
    [
        (0.45, 0.5, (Status.FAILURE, "safe")),
        (0.50, 0.5, (Status.SUCCESS, "force")),
        (0.50, 1.0, (Status.FAILURE, "safe")),
        (1.00, 1.0, (Status.SUCCESS, "force")),
    ],
)
def test_force_over_its_threshold_for_too_long(bench, over_s, patience_s, expected):
    bench.hold()
    bench.board.force_over_s = over_s
    assert says(bench, patience_s=patience_s) == expected


@pytest.mark.parametrize(
    ("state", "unexplained", "expected"),
    [
        (1, True, "safe"),
        (2, False, "safe"),
        (2, True, "unexplained"),
        (3, True, "unexplained"),
        (None, True, "safe"),
    ],
)
def test_a_mismatch_that_learning_could_not_explain(bench, state, unexplained, expected):
    bench.hold()
    bench.warn(state)
    bench.board.unexplained = unexplained
    assert says(bench)[1] == expected


@pytest.mark.parametrize(
    ("learned_in", "ticks_ago", "expected"),
    [(2, 0, "safe"), (2, 1, "unexplained"), (1, 1, "safe")],
)
def test_a_mismatch_that_came_back_after_learning(bench, learned_in, ticks_ago, expected):
    """Learning gets its chance in the tick in which it ran; nothing new was seen since."""
    bench.hold()
    bench.warn(2)
    bench.world.ticks = 100
    bench.board.last_learning = LearningAttempt(100 - ticks_ago, learned_in, {})
    assert says(bench)[1] == expected


def test_patience_is_not_negative(bench):
    with pytest.raises(ValidationError, match="greater than or equal to 0"):
        bench.node(GripUnsafe, patience_s=-0.1)
