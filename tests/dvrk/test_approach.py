"""Whatever is pursued: no limit is broken, and the goal is reached."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defras_bt.dvrk.streaming.approach import Approach, ApproachLimits

LIMITS = ApproachLimits(speed=0.06, acceleration=0.5, braking=5.0, step=0.001)
PERIOD_S = 0.01
coordinate = st.floats(-0.05, 0.05)
goals = st.lists(
    st.tuples(st.tuples(coordinate, coordinate, coordinate), st.floats(0.001, 0.2)),
    min_size=1,
    max_size=6,
)


@given(goals, st.lists(st.floats(0.004, 0.02), min_size=20, max_size=80))
def test_no_limit_is_broken_on_the_way(
    pursued: list[tuple[tuple[float, float, float], float]], periods_s: list[float]
) -> None:
    approach = Approach(LIMITS, np.zeros(3))
    speed = 0.0
    for number, period_s in enumerate(periods_s):
        if number % 10 == 0:
            goal, pace = pursued[(number // 10) % len(pursued)]
            approach.pursue(np.array(goal), pace)
        before = approach.at.copy()
        approach.step(period_s)
        moved = float(np.linalg.norm(approach.at - before))
        assert moved <= LIMITS.step + 1e-9
        assert moved <= LIMITS.speed * period_s + 1e-8
        faster = float(np.linalg.norm(approach.velocity)) - speed
        assert faster <= LIMITS.braking * period_s + 1e-9
        speed = float(np.linalg.norm(approach.velocity))


def test_from_rest_speed_grows_with_the_acceleration_and_no_faster() -> None:
    approach = Approach(LIMITS, np.zeros(3))
    approach.pursue(np.array([0.05, 0.0, 0.0]), 0.05)
    for period in range(1, 6):
        approach.step(PERIOD_S)
        assert approach.velocity[0] == pytest.approx(LIMITS.acceleration * PERIOD_S * period)


@given(st.tuples(coordinate, coordinate, coordinate), st.floats(0.005, 0.06))
def test_the_goal_is_reached_and_kept(goal: tuple[float, float, float], pace: float) -> None:
    approach = Approach(LIMITS, np.zeros(3))
    approach.pursue(np.array(goal), pace)
    for _ in range(int(0.15 / pace / PERIOD_S) + 40):
        approach.step(PERIOD_S)
    np.testing.assert_array_equal(approach.at, goal)
    approach.step(PERIOD_S)
    np.testing.assert_array_equal(approach.at, goal)


def test_stopping_takes_the_way_that_braking_needs() -> None:
    approach = Approach(LIMITS, np.zeros(3))
    approach.pursue(np.array([0.05, 0.0, 0.0]), 0.06)
    for _ in range(30):
        approach.step(PERIOD_S)
    at_m, speed = approach.at[0], approach.velocity[0]
    approach.stop()
    for _ in range(4):
        approach.step(PERIOD_S)
    assert approach.at[0] - at_m == pytest.approx(speed**2 / (2 * LIMITS.braking))
    assert not approach.velocity.any()


def test_without_time_nothing_moves() -> None:
    approach = Approach(LIMITS, np.zeros(3))
    approach.pursue(np.ones(3), 0.06)
    np.testing.assert_array_equal(approach.step(0.0), np.zeros(3))
