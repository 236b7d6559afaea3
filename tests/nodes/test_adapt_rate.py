"""AdaptRate halves the rate from its nominal value while something is off."""

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.executive.nodes import AdaptRate


@pytest.mark.parametrize(
    ("state", "force_n", "rate"),
    [(0, 0.0, 1.0), (0, 0.3, 1.0), (1, 0.0, 0.5), (0, 0.31, 0.5), (1, 0.31, 0.5), (2, 0.0, 0.5)],
)
def test_rate_by_state_and_force(bench, state, force_n, rate):
    bench.warn(state)
    bench.says["force_n"] = force_n
    node = bench.node(AdaptRate)
    assert bench.tick(node) == Status.SUCCESS
    assert bench.board.rate == rate
    assert node.code == ("nominal" if rate == 1.0 else "slowed")


def test_a_force_that_nobody_knows_is_over_as_guards_see_it(bench):
    bench.warn(0)
    bench.says["force_n"] = float("nan")
    node = bench.node(AdaptRate)
    bench.tick(node)
    assert bench.board.rate == 0.5
    assert "unknown force" in node.feedback_message


def test_the_rate_is_not_halved_again_every_tick(bench):
    bench.warn(1)
    node = bench.node(AdaptRate, slow=0.5)
    rates = []
    for _ in range(5):
        bench.tick(node)
        rates.append(bench.board.rate)
    assert rates == [0.5] * 5
    bench.warn(0)
    bench.tick(node)
    assert bench.board.rate == 1.0


def test_how_slow_is_the_tree_s_choice(bench):
    bench.warn(1)
    bench.tick(bench.node(AdaptRate, slow=0.25))
    assert bench.board.rate == 0.25


def test_every_reason_is_named(bench):
    bench.warn(1)
    bench.says["force_n"] = 0.42
    node = bench.node(AdaptRate)
    bench.tick(node)
    assert node.feedback_message == "slowed to 50%: warning state 1, 0.42 N"


def test_without_monitoring_only_the_force_counts(bench):
    bench.board.metric = None
    bench.warn(3)
    bench.tick(bench.node(AdaptRate))
    assert bench.board.rate == 1.0


@pytest.mark.parametrize("slow", [0.0, 1.5, -1.0, float("nan")])
def test_a_rate_that_is_none_is_refused(bench, slow):
    with pytest.raises(ValidationError):
        bench.node(AdaptRate, slow=slow)
