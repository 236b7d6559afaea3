"""Move carries the held tissue in the plane towards the region, at most over its centre."""

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.acting.manoeuvre import Move
from tests.nodes.manoeuvre_checks import ManoeuvreChecks


class TestMove(ManoeuvreChecks):
    leaf = Move

    def target_m(self, bench, start_m):
        """30 mm towards the region's centre at (10, 0) mm; (2, 4) is 43 mm away from it."""
        towards = np.array([0.010, 0.0]) - start_m[:2]
        return np.array([*(start_m[:2] + 0.03 * towards / np.hypot(*towards)), start_m[2]])


def test_it_stops_over_the_centre_of_the_region(bench):
    bench.hold((3, 3))
    bench.put("psm1", (0.0, 0.005, 0.04))
    node = bench.node(Move, arm="psm1", point=(3, 3))
    assert bench.run(node) == Status.SUCCESS
    assert bench.tip_m() == pytest.approx((0.010, 0.0, 0.04), abs=2e-4)
