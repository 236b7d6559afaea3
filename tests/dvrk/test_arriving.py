"""A tree that commands a stream ends where it should, however late its commands come."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.acting.arm_action import ARRIVED_M, arriving_m_s
from defras_bt.dvrk.settings import Stream
from defras_bt.dvrk.streaming.tip_stream import TipStream, TipVelocity
from defras_sim.geometry import Pose

TICK_S, PERIOD_S = 0.05, 0.01
TARGET_M = np.array([0.03, -0.02, -0.04])


def arrive(speed_m_s: float, late_periods: int, *, goal_ahead: bool = True) -> tuple[float, int]:
    """Go as an action does; how far from the target the arm ends, and after how many ticks."""
    stream = TipStream(Stream(), Pose(np.zeros(3)))
    rng = np.random.default_rng(late_periods)
    for tick in range(400):
        way_m = TARGET_M - stream.goal.position_m
        distance_m = float(np.linalg.norm(way_m))
        velocity = TipVelocity()
        if distance_m > ARRIVED_M:
            speed = arriving_m_s(distance_m, speed_m_s, TICK_S, goal_ahead=goal_ahead)
            velocity = TipVelocity(way_m * (speed / distance_m))
        late = int(rng.integers(0, late_periods + 1))
        for period in range(5):
            if period == late:
                stream.command(velocity, TICK_S)
            stream.step(PERIOD_S)
        if not velocity.moves:
            return float(np.linalg.norm(TARGET_M - stream.pose.position_m)), tick
    raise AssertionError("it never arrived")


@pytest.mark.parametrize("speed_m_s", [0.015, 0.05])
@pytest.mark.parametrize("late_periods", [0, 1, 2, 4])
def test_it_ends_at_the_target(speed_m_s: float, late_periods: int) -> None:
    missed_m, ticks = arrive(speed_m_s, late_periods)
    assert missed_m <= 2 * ARRIVED_M
    ideal = float(np.linalg.norm(TARGET_M)) / speed_m_s / TICK_S
    assert ticks <= 1.2 * ideal + 12


def test_where_set_points_arrive_with_the_tick_nothing_is_slowed() -> None:
    assert arriving_m_s(0.001, 0.05, TICK_S, goal_ahead=False) == pytest.approx(0.02)
    assert arriving_m_s(0.1, 0.05, TICK_S, goal_ahead=True) == 0.05
