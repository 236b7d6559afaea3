"""RestCalibrated holds from the moment somebody calibrated."""

from py_trees.common import Status

from defras_bt.monitoring.guards import RestCalibrated


def test_before_and_after(bench):
    node = bench.node(RestCalibrated)
    assert (bench.tick(node), node.code) == (Status.FAILURE, "not_calibrated")
    bench.board.rest_calibrated = True
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "calibrated")
