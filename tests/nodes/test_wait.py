"""Wait holds still for a while of world time."""

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.executive.blackboard import LONGEST_WATCH_S
from defras_bt.executive.nodes import Wait


def test_it_ends_after_its_seconds(bench):
    node = bench.node(Wait, seconds=1.0)
    assert (bench.tick(node), node.code) == (Status.RUNNING, "waiting")
    assert bench.run(node) == Status.SUCCESS
    assert node.code == "waited"
    assert bench.world.time_s == pytest.approx(1.0, abs=2 * bench.scene.tick_s + 1e-9)
    assert all(not command.arms for command in bench.world.sent)


def test_the_clock_is_the_world_s(bench):
    """Ticks may be long: in a world that is slow, fewer of them are waited for."""
    node = bench.node(Wait, seconds=3.0)
    bench.tick(node)
    ticks = 0
    while node.status == Status.RUNNING:
        bench.world.ticks += 7
        bench.tick(node)
        ticks += 1
    assert ticks == round(3.0 / (8 * bench.scene.tick_s))


def test_what_nobody_watched_is_not_waited(bench):
    """A tick in which the tree learned for half a minute says nothing of what would have come."""
    node = bench.node(Wait, seconds=3.0)
    bench.tick(node)
    bench.world.ticks += 600
    assert bench.tick(node) == Status.RUNNING
    again_s = bench.world.time_s
    assert bench.run(node) == Status.SUCCESS
    assert bench.world.time_s - again_s >= 3.0 - LONGEST_WATCH_S - 2 * bench.scene.tick_s


def test_interrupted_it_starts_anew(bench):
    node = bench.node(Wait, seconds=0.5)
    for _ in range(8):
        bench.tick(node)
    node.stop(Status.INVALID)
    again_s = bench.world.time_s
    assert bench.run(node) == Status.SUCCESS
    assert bench.world.time_s - again_s >= 0.5


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("inf")])
def test_a_wait_has_an_end(bench, seconds):
    with pytest.raises(ValidationError):
        bench.node(Wait, seconds=seconds)
