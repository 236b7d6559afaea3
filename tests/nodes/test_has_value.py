"""HasValue lets those pass who read a port only once there is something to read."""

from py_trees.common import Status

from defras_bt.executive.port_nodes import HasValue


def test_it_fails_until_something_was_written(bench):
    node = bench.node(HasValue)
    node.keys = {"port": "tension_n"}
    assert (bench.tick(node), node.code) == (Status.FAILURE, "no_value")
    assert node.feedback_message == "tension_n has no value yet"
    bench.board.ports.write("other", 1.0)
    assert bench.tick(node) == Status.FAILURE
    bench.board.ports.write("tension_n", 0.0)
    assert (bench.tick(node), node.code) == (Status.SUCCESS, "has_value")
    assert node.feedback_message == "tension_n has a value"


def test_what_is_known_stays_known(bench):
    node = bench.node(HasValue)
    bench.board.ports.write("port", None)
    assert [bench.tick(node) for _ in range(3)] == [Status.SUCCESS] * 3
