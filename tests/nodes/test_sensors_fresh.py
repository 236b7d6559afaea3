"""SensorsFresh fails as soon as anything is missing, and says what."""

from py_trees.common import Status

from defras_bt.monitoring.guards import SensorsFresh


def test_nothing_missing(bench):
    node = bench.node(SensorsFresh)
    assert bench.tick(node) == Status.SUCCESS
    assert node.code == "fresh"


def test_every_missing_reading_is_named(bench):
    bench.says["missing"] = ("cloud is 0.60 s old", "psm2 is missing")
    node = bench.node(SensorsFresh)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "stale"
    assert node.feedback_message == "cloud is 0.60 s old; psm2 is missing"


def test_it_changes_its_mind_within_a_tick(bench):
    node = bench.node(SensorsFresh)
    statuses = []
    for missing in ((), ("cloud",), ()):
        bench.says["missing"] = missing
        statuses.append(bench.tick(node))
    assert statuses == [Status.SUCCESS, Status.FAILURE, Status.SUCCESS]
