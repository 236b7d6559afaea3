"""Reach goes up to clearance, across, and straight down onto the grasp point."""

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.acting.arm_action import ARRIVED_M
from defras_bt.acting.reach import Reach


@pytest.fixture
def reach(bench):
    return bench.node(Reach, arm="psm1", point=(2, 4))


@pytest.fixture
def goal_m(bench):
    return np.array([*bench.scene.grasp_xy_m(2, 4), 0.0])


def travel(bench, node):
    """Tick to the end; tip positions and speeds on the way."""
    tips, speeds = [bench.tip_m()], []
    while bench.tick(node) == Status.RUNNING:
        assert node.code == "moving"
        tips.append(bench.tip_m())
        speeds.append(float(np.linalg.norm(bench.commanded_m_s())))
        assert len(tips) < 400, "never arrives"
    return np.array(tips), np.array(speeds)


def test_it_ends_on_the_grasp_point_and_says_so(bench, reach, goal_m):
    assert bench.run(reach) == Status.SUCCESS
    assert reach.code == "done"
    np.testing.assert_allclose(bench.tip_m(), goal_m, atol=ARRIVED_M)
    assert bench.board.at == {"psm1": (2, 4)}
    assert len(bench.told("action")) == 1
    assert bench.told("action") == ["PSM1 has reached grasp point (2, 4)."]
    assert bench.board.events[-1].data == {"action": "reach", "arm": "psm1"}


def test_it_moves_sideways_only_at_clearance_and_descends_straight(bench, reach, goal_m):
    bench.put("psm1", (0.04, 0.05, 0.001))
    tips, _ = travel(bench, reach)
    sideways = np.linalg.norm(np.diff(tips[:, :2], axis=0), axis=1) > ARRIVED_M
    clearance_m = bench.scene.motion.clearance_m - ARRIVED_M
    assert sideways.any()
    assert (tips[:-1][sideways][:, 2] >= clearance_m - 1e-12).all()
    assert (tips[1:][sideways][:, 2] >= clearance_m - 1e-12).all()


def test_a_tip_above_clearance_stays_at_its_height_until_it_is_over_the_point(bench, reach, goal_m):
    bench.put("psm1", (0.04, 0.05, 0.055))
    tips, _ = travel(bench, reach)
    beside = np.linalg.norm(tips[:, :2] - goal_m[:2], axis=1) > 2 * ARRIVED_M
    np.testing.assert_allclose(tips[beside][:, 2], 0.055, atol=1e-9)


def test_speed_is_at_most_that_of_a_reach(bench, reach):
    _, speeds = travel(bench, reach)
    limit = bench.scene.motion.reach_speed_m_s
    assert speeds.max() == pytest.approx(limit)
    assert (speeds <= limit + 1e-12).all()


def test_on_the_way_the_arm_is_at_no_grasp_point(bench, reach):
    bench.board.at["psm1"] = (5, 5)
    bench.tick(reach)
    assert reach.status == Status.RUNNING
    assert bench.board.at == {}


def test_it_commands_only_its_own_arm_and_no_jaw(bench):
    reach = bench.node(Reach, arm="psm2", point=(2, 2))
    bench.tick(reach)
    assert set(bench.board.command.arms) == {"psm2"}
    assert bench.commanded_jaw_rad("psm2") is None


def test_an_arm_that_is_there_already_finishes_at_once_without_moving(bench, reach, goal_m):
    bench.put("psm1", goal_m)
    assert bench.tick(reach) == Status.SUCCESS
    assert bench.board.command.arms == {}


def test_an_arm_that_holds_tissue_does_not_reach_elsewhere(bench):
    bench.hold((2, 4))
    reach = bench.node(Reach, arm="psm1", point=(3, 4))
    assert bench.tick(reach) == Status.FAILURE
    assert reach.code == "holding"
    assert bench.board.command.arms == {}
    assert bench.told("action") == []


def test_half_the_rate_takes_twice_as_long_and_still_arrives(bench, reach, goal_m):
    """The gate scales commands; a reach must not count on having moved as far as it asked."""
    ticks = 0
    while bench.tick(reach) == Status.RUNNING:
        moved = bench.commanded_m_s() * bench.scene.tick_s
        bench.put("psm1", bench.tip_m() - moved / 2)
        ticks += 1
        assert ticks < 1000, "never arrives"
    np.testing.assert_allclose(bench.tip_m(), goal_m, atol=ARRIVED_M)
