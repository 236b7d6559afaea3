"""Velocities for 50 ms become set-points for 10 ms: nothing is lost, and slowing is at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.settings import Stream
from defras_bt.dvrk.streaming.tip_stream import TipStream, TipVelocity
from defras_sim.geometry import Floats, Pose

LIMITS = Stream()
PERIOD_S, TICK_S = 0.01, 0.05
X = np.array([1.0, 0.0, 0.0])


@pytest.fixture
def stream() -> TipStream:
    return TipStream(LIMITS, Pose(np.array([0.01, 0.02, -0.1])))


def go(stream: TipStream, linear_m_s: Floats, periods: int = 5) -> list[Floats]:
    """The velocity for one tick, carried out for so many periods: the steps (3,)."""
    stream.command(TipVelocity(linear_m_s), TICK_S)
    steps = []
    for _ in range(periods):
        before_m = stream.pose.position_m
        steps.append(stream.step(PERIOD_S).position_m - before_m)
    return steps


def test_ticks_add_up_exactly(stream: TipStream) -> None:
    start_m = stream.pose.position_m
    for _ in range(20):
        go(stream, 0.02 * X)
    assert stream.goal.position_m[0] - start_m[0] == pytest.approx(20 * 0.02 * TICK_S)
    for _ in range(10):  # what accelerating cost is made good
        stream.step(PERIOD_S)
    np.testing.assert_allclose(stream.pose.position_m, stream.goal.position_m, atol=1e-12)


def test_a_late_command_costs_nothing(stream: TipStream) -> None:
    rng = np.random.default_rng(3)
    start_m = stream.pose.position_m
    for _ in range(40):
        go(stream, 0.02 * X, periods=int(rng.integers(4, 7)))
    for _ in range(20):
        stream.step(PERIOD_S)
    assert stream.pose.position_m[0] - start_m[0] == pytest.approx(40 * 0.02 * TICK_S, rel=0.02)


def test_silence_is_a_hold(stream: TipStream) -> None:
    go(stream, 0.02 * X, periods=30)
    np.testing.assert_allclose(stream.pose.position_m - [0.01, 0.02, -0.1], 0.02 * TICK_S * X)
    assert not stream.moving


def test_slower_is_slower_with_the_next_set_point(stream: TipStream) -> None:
    for _ in range(10):
        fast = go(stream, 0.05 * X)
    slow = go(stream, 0.025 * X)
    assert [np.linalg.norm(step) for step in fast] == pytest.approx([0.05 * PERIOD_S] * 5)
    # Braking takes 5 m/s2: half of 50 mm/s within one period.
    assert np.linalg.norm(slow[0]) == pytest.approx(0.025 * PERIOD_S)


def test_no_velocity_stops_within_two_periods(stream: TipStream) -> None:
    for _ in range(10):
        go(stream, 0.05 * X)
    stopping = go(stream, 0.0 * X, periods=4)
    assert np.linalg.norm(stopping[0]) < 0.05 * PERIOD_S
    assert np.linalg.norm(stopping[2]) < 1e-12
    np.testing.assert_array_equal(stream.goal.position_m, stream.pose.position_m)


def test_another_way_starts_from_where_the_stream_is(stream: TipStream) -> None:
    for _ in range(4):
        go(stream, 0.05 * X)
    turned_m = stream.pose.position_m
    stream.command(TipVelocity(np.array([0.0, 0.01, 0.0])), TICK_S)
    np.testing.assert_allclose(stream.goal.position_m - turned_m, [0.0, 0.0005, 0.0], atol=1e-12)


def test_commands_that_pile_up_are_not_all_carried_out(stream: TipStream) -> None:
    start_m = stream.pose.position_m
    for _ in range(20):
        stream.command(TipVelocity(0.02 * X), TICK_S)
    assert stream.goal.position_m[0] - start_m[0] <= 2.0 * 0.02 * TICK_S + 1e-12


def test_waiting_keeps_what_is_left_to_go(stream: TipStream) -> None:
    stream.command(TipVelocity(0.02 * X), TICK_S)
    stream.step(PERIOD_S)
    here_m, goal_m = stream.pose.position_m, stream.goal.position_m
    for _ in range(5):
        stream.wait()
    np.testing.assert_array_equal(stream.pose.position_m, here_m)
    np.testing.assert_array_equal(stream.goal.position_m, goal_m)


def test_turning_turns_about_the_tip(stream: TipStream) -> None:
    rate = np.array([0.0, 0.0, 0.4])
    for _ in range(5):
        stream.command(TipVelocity(np.zeros(3), rate), TICK_S)
        for _ in range(5):
            stream.step(PERIOD_S)
    for _ in range(30):
        stream.step(PERIOD_S)
    turned = Rotation.from_matrix(stream.pose.rotation).as_rotvec()
    np.testing.assert_allclose(turned, 5 * TICK_S * rate, atol=1e-9)
    np.testing.assert_array_equal(stream.pose.position_m, [0.01, 0.02, -0.1])
