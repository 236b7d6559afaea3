"""Open drives the jaw wide, without moving the tip and never while holding tissue."""

from py_trees.common import Status

from defras_bt.acting.jaw import JAW_TIME_OUT_S, Open
from defras_sim.worlds.protocol import JAW_OPEN_RAD


def test_it_opens_the_jaw_and_leaves_the_tip_where_it_is(bench):
    tip_m = bench.tip_m().copy()
    node = bench.node(Open, arm="psm1", point=(2, 4))
    assert bench.tick(node) == Status.RUNNING
    assert node.code == "opening"
    assert bench.commanded_jaw_rad() == JAW_OPEN_RAD
    assert bench.run(node) == Status.SUCCESS
    assert node.code == "done"
    assert (bench.tip_m() == tip_m).all()
    assert len(bench.told("action")) == 1


def test_it_does_not_drop_tissue(bench):
    bench.hold((2, 4))
    node = bench.node(Open, arm="psm1", point=(2, 4))
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "holding"
    assert bench.board.command.arms == {}


def test_a_stuck_jaw_is_reported_after_a_time_of_the_world(bench):
    bench.world.stuck.add("psm1")
    node = bench.node(Open, arm="psm1", point=(2, 4))
    started_s = bench.world.time_s
    assert bench.run(node) == Status.FAILURE
    assert node.code == "jaw_stuck"
    assert "stands at 0.00 rad" in node.feedback_message
    assert JAW_TIME_OUT_S < bench.world.time_s - started_s < JAW_TIME_OUT_S + 0.2
    assert bench.told("action") == []
