"""Grasp closes the jaw where it should; a grasp that gets nothing blocks its point."""

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.acting.jaw import JAW_TIME_OUT_S, Grasp
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, JAW_OPEN_RAD


@pytest.fixture
def grasp(bench):
    """A grasp with the open jaw in place."""
    bench.put("psm1", (*bench.scene.grasp_xy_m(2, 4), 0.0), jaw_rad=JAW_OPEN_RAD)
    bench.board.at["psm1"] = (2, 4)
    return bench.node(Grasp, arm="psm1", point=(2, 4))


def test_it_closes_until_the_jaw_holds(bench, grasp):
    tip_m = bench.tip_m().copy()
    assert bench.tick(grasp) == Status.RUNNING
    assert grasp.code == "closing"
    assert bench.commanded_jaw_rad() == JAW_CLOSED_RAD
    assert bench.run(grasp) == Status.SUCCESS
    assert grasp.code == "done"
    grip = bench.board.grips["psm1"]
    assert (grip.point, grip.done, grip.starts_m) == ((2, 4), (), {})
    np.testing.assert_array_equal(grip.grasp_tip.position_m, tip_m)
    assert bench.twin.holding == {"psm1"}
    assert len(bench.told("action")) == 1
    assert bench.board.blocked == set()


def test_a_jaw_that_closes_on_nothing_blocks_the_point(bench, grasp):
    bench.world.slippery = True
    assert bench.run(grasp) == Status.FAILURE
    assert grasp.code == "nothing_grasped"
    assert bench.board.blocked == {(2, 4)}
    assert bench.told("action") == []


def test_a_jaw_that_neither_closes_nor_holds_times_out_and_blocks_the_point(bench, grasp):
    bench.world.stuck.add("psm1")
    assert bench.run(grasp) == Status.FAILURE
    assert grasp.code == "nothing_grasped"
    assert JAW_TIME_OUT_S < bench.world.time_s < JAW_TIME_OUT_S + 0.2
    assert bench.board.blocked == {(2, 4)}


@pytest.mark.parametrize("at", [None, (3, 4)])
def test_it_grasps_nothing_away_from_its_point(bench, grasp, at):
    bench.board.at = {} if at is None else {"psm1": at}
    assert bench.tick(grasp) == Status.FAILURE
    assert grasp.code == "not_there"
    assert bench.board.command.arms == {}
    assert bench.board.blocked == set()
