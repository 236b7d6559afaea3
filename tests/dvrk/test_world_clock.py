"""World time of a robot: from its stamps, and on between them."""

from __future__ import annotations

from time import monotonic, sleep

import pytest

from defras_bt.dvrk.world_clock import WorldClock


def test_stamps_count_from_the_begin() -> None:
    clock = WorldClock(100.0, 0.05, simulated=False)
    assert clock.world_s(101.25) == pytest.approx(1.25)


def test_time_runs_on_between_looks() -> None:
    clock = WorldClock(100.0, 0.05, simulated=False)
    clock.looked(103.0)
    sleep(0.02)
    assert 3.02 <= clock.now_s() < 4.0
    clock.looked(103.01)
    assert clock.now_s() == pytest.approx(3.01, abs=0.02)


def test_a_simulations_clock_does_not_run_on_by_itself() -> None:
    clock = WorldClock(100.0, 0.05, simulated=True)
    clock.looked(103.0)
    sleep(0.01)
    assert clock.now_s() == pytest.approx(3.0)


def test_ticks_keep_their_pace() -> None:
    clock = WorldClock(0.0, 0.01, simulated=False)
    began_s = monotonic()
    for _ in range(10):
        clock.wait_for_tick(lambda: 0.0)
    assert monotonic() - began_s >= 0.1


def test_a_tick_of_a_simulation_ends_with_its_clock() -> None:
    clock, shown = WorldClock(5.0, 0.05, simulated=True), iter([5.0, 5.02, 5.05, 5.09, 5.2])
    clock.wait_for_tick(lambda: next(shown))
    assert next(shown) == 5.09


def test_a_simulation_that_stands_is_not_waited_for_for_ever() -> None:
    clock = WorldClock(5.0, 0.005, simulated=True)
    began_s = monotonic()
    clock.wait_for_tick(lambda: 5.0)
    assert 0.05 <= monotonic() - began_s < 5.0
