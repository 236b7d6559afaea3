"""WarningReached answers yes only for a state that is known."""

import pytest
from py_trees.common import Status

from defras_bt.monitoring.guards import WarningReached


@pytest.mark.parametrize("asked", [1, 2, 3])
@pytest.mark.parametrize("state", [0, 1, 2, 3])
def test_known_states(bench, asked, state):
    bench.warn(state)
    node = bench.node(WarningReached, state=asked)
    bench.tick(node)
    expected = (Status.SUCCESS, "reached") if state >= asked else (Status.FAILURE, "below")
    assert (node.status, node.code) == expected


def test_an_unknown_state_is_not_reached(bench):
    """Nothing is learned from, and no human called for, on the strength of no data."""
    node = bench.node(WarningReached, state=1)
    bench.warn(None)
    assert (bench.tick(node), node.feedback_message) == (
        Status.FAILURE,
        "the warning state is unknown",
    )
    bench.warn(3, mu_m=float("nan"))
    assert bench.tick(node) == Status.FAILURE
