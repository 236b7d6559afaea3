"""RegionVisible succeeds only on a known visibility of at least the scene's share."""

import pytest
from py_trees.common import Status

from defras_bt.monitoring.guards import RegionVisible


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (0.0, "hidden"),
        (0.79, "hidden"),
        (0.8, "visible"),
        (1.0, "visible"),
        (None, "hidden"),
        (float("nan"), "hidden"),
    ],
)
def test_visibility(bench, seen, expected):
    bench.world.visibility = seen
    node = bench.node(RegionVisible)
    status = bench.tick(node)
    assert node.code == expected
    assert status == (Status.SUCCESS if expected == "visible" else Status.FAILURE)
