"""The clock of a simulated world: no drift, and every sensor exactly as often as it should."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from defras_sim.worlds.clock import TickClock


def due_at(tick_s: float, period_s: float, ticks: int) -> list[int]:
    clock, found = TickClock(tick_s), []
    for number in range(ticks + 1):
        if clock.due(period_s):
            found.append(number)
        clock.tick()
    return found


@pytest.mark.parametrize(
    ("tick_s", "period_s", "ticks"),
    [
        (0.05, 0.1, [0, 2, 4, 6, 8, 10]),
        (0.05, 0.05, list(range(11))),
        (0.05, 0.03, list(range(11))),
        (0.05, 0.12, [0, 3, 5, 8, 10]),
    ],
)
def test_a_sensor_is_due_at_the_first_tick_after_its_period(tick_s, period_s, ticks):
    assert due_at(tick_s, period_s, 10) == ticks


@given(st.floats(0.01, 0.1), st.integers(1, 9))
def test_whole_periods_are_met_exactly_however_they_round(tick_s, every):
    assert due_at(tick_s, every * tick_s, 2000) == list(range(0, 2001, every))


def test_time_is_a_multiple_of_the_tick():
    clock = TickClock(0.05)
    for _ in range(100_000):
        clock.tick()
    assert clock.time_s == 100_000 * 0.05
