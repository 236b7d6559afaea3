"""Time of the stand-in: what passes, adds up, and never runs back."""

import numpy as np
import pytest

from defras_bt.dvrk.stand_in.pacing import SIMULATED_START_S, RealPace, SimulatedPace


def test_a_simulated_clock_tells_every_period_once_in_even_steps():
    told: list[float] = []
    pace = SimulatedPace(0.01, 1000.0, told.append)
    passed = [pace.next_period_s() for _ in range(50)]
    assert passed == [0.01] * 50
    assert told[0] == pytest.approx(SIMULATED_START_S + 0.01)
    assert np.diff(told) == pytest.approx(0.01)
    assert pace.now_s() == pytest.approx(0.5)
    assert pace.ros_s() == told[-1]


def test_periods_of_the_real_clock_add_up_to_the_time_that_passed():
    pace = RealPace(0.002)
    passed = [pace.next_period_s() for _ in range(20)]
    assert all(time_s > 0.0 for time_s in passed)
    # Between the last period and this look a moment passed, which none of them has.
    assert 0.038 <= sum(passed) <= pace.now_s()
    assert pace.ros_s() >= pace.start_s + sum(passed)
