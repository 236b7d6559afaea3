"""RegionVisible succeeds on a known visibility of the scene's share, seen several times."""

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
    for _ in range(3):
        status = bench.tick(node)
    assert node.code == expected
    assert status == (Status.SUCCESS if expected == "visible" else Status.FAILURE)


def answers(bench, node, *seen):
    """What the node says to these readings, one a tick."""
    said = []
    for share in seen:
        bench.world.visibility = share
        said.append(bench.tick(node) == Status.SUCCESS)
    return said


@pytest.mark.parametrize("readings", [1, 3, 5])
def test_so_many_readings_in_a_row_are_asked_for(bench, readings):
    node = bench.node(RegionVisible, readings=readings)
    row = [False] * (readings - 1) + [True, True]
    assert answers(bench, node, *[0.9] * len(row)) == row
    assert answers(bench, node, 0.1, *[0.9] * len(row)) == [False, *row]


def test_one_false_reading_is_never_enough(bench):
    node = bench.node(RegionVisible)
    assert not any(answers(bench, node, *[0.1, 0.1, 1.0, 0.1, 1.0, 1.0, None, 1.0] * 3))
    assert "1 of 3 readings in a row" in node.feedback_message


def test_the_same_reading_over_and_over_is_one(bench):
    bench.world.visibility = 0.9
    seen = bench.world.observe()
    node = bench.node(RegionVisible)
    for _ in range(10):
        bench.says["observation"] = seen
        assert bench.tick(node) == Status.FAILURE


def test_ticks_in_which_nobody_asked_interrupt_the_row(bench):
    node, other = bench.node(RegionVisible), bench.scripted("other", "FAILURE")
    assert answers(bench, node, 0.9, 0.9) == [False, False]
    bench.tick(other)
    assert answers(bench, node, 0.9, 0.9, 0.9) == [False, False, True]
