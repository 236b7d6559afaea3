"""OperatorPermits fails while the operator asks to stop."""

from py_trees.common import Status

from defras_bt.monitoring.guards import OperatorPermits


def test_no_stop_asked(bench):
    node = bench.node(OperatorPermits)
    assert bench.tick(node) == Status.SUCCESS
    assert node.code == "permitted"


def test_a_stop_is_passed_on_in_the_operator_s_words(bench):
    bench.says["operator_stop"] = "the operator pressed the pedal"
    node = bench.node(OperatorPermits)
    assert bench.tick(node) == Status.FAILURE
    assert (node.code, node.feedback_message) == ("stopped", "the operator pressed the pedal")
