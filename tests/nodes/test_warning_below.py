"""WarningBelow permits motion only under a warning state that is known to be low enough."""

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.monitoring.guards import WarningBelow


@pytest.mark.parametrize("limit", [1, 2, 3])
@pytest.mark.parametrize("state", [0, 1, 2, 3])
def test_known_states(bench, limit, state):
    bench.warn(state)
    node = bench.node(WarningBelow, state=limit)
    bench.tick(node)
    expected = (Status.SUCCESS, "below") if state < limit else (Status.FAILURE, "warned")
    assert (node.status, node.code) == expected


def test_an_unknown_state_permits_nothing(bench):
    node = bench.node(WarningBelow, state=3)
    for why, silence in {
        "no reading": lambda: bench.warn(None),
        "mu is NaN": lambda: bench.warn(0, mu_m=float("nan")),
        "the tree names no metric": lambda: setattr(bench.board, "metric", None),
    }.items():
        silence()
        assert (bench.tick(node), node.code) == (Status.FAILURE, "warning_unknown"), why
        bench.warn(0)


def test_only_the_tree_s_own_metric_counts(bench):
    bench.warn(0)
    bench.says["reading"].warning_state["median"] = 3
    node = bench.node(WarningBelow, state=1)
    assert bench.tick(node) == Status.SUCCESS
    bench.board.metric = "median"
    assert bench.tick(node) == Status.FAILURE


@pytest.mark.parametrize("state", [0, 4, 1.5])
def test_states_that_do_not_exist_are_refused(bench, state):
    with pytest.raises(ValidationError):
        bench.node(WarningBelow, state=state)
