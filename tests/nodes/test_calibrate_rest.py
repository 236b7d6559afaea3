"""CalibrateRest waits, hands off, until monitoring knows the untouched tissue."""

from py_trees.common import Status

from defras_bt.executive.nodes import CalibrateRest


def test_it_watches_until_monitoring_is_calibrated(bench):
    node = bench.node(CalibrateRest)
    assert (bench.tick(node), node.code) == (Status.RUNNING, "watching")
    assert not bench.board.rest_calibrated
    assert bench.board.command.arms == {}
    bench.monitor.calibration = {"local": "rest value 0.50 mm", "median": "rest value 0.10 mm"}
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "calibrated")
    assert bench.board.rest_calibrated
    assert bench.told("start") == [
        "Monitoring is calibrated, local: rest value 0.50 mm.",
        "Monitoring is calibrated, median: rest value 0.10 mm.",
    ]
