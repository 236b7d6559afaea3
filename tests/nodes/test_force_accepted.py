"""ForceAccepted tolerates a force over its threshold for a moment, an unknown one not at all."""

import pytest
from py_trees.common import Status

from defras_bt.monitoring.guards import ForceAccepted


@pytest.mark.parametrize(
    ("force_n", "over_s", "expected"),
    [
        (0.0, 0.0, "accepted"),
        (0.3, 0.0, "accepted"),
        (0.9, 0.45, "accepted"),
        (0.9, 0.5, "force_too_high"),
        (float("inf"), 2.0, "force_too_high"),
        (float("nan"), 0.0, "force_unknown"),
        (float("nan"), 2.0, "force_unknown"),
    ],
)
def test_force_and_time_over_the_threshold(bench, force_n, over_s, expected):
    bench.says["force_n"] = force_n
    bench.board.force_over_s = over_s
    node = bench.node(ForceAccepted, patience_s=0.5)
    status = bench.tick(node)
    assert node.code == expected
    assert status == (Status.SUCCESS if expected == "accepted" else Status.FAILURE)


def test_patience_is_the_tree_s_choice(bench):
    bench.says["force_n"] = 0.9
    bench.board.force_over_s = 0.5
    assert bench.tick(bench.node(ForceAccepted, patience_s=1.0)) == Status.SUCCESS
    assert bench.tick(bench.node(ForceAccepted, patience_s=0.0)) == Status.FAILURE


def test_the_message_carries_the_numbers(bench):
    bench.says["force_n"] = 0.42
    bench.board.force_over_s = 0.75
    node = bench.node(ForceAccepted)
    bench.tick(node)
    assert node.feedback_message == ("the force is 0.42 N, over its threshold of 0.30 N for 0.75 s")
