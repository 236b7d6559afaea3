"""Rest calibration keeps the false-alarm rate that it states."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.monitoring.rest import calibrate_rest

DELTA_M = (0.002, 0.004, 0.006)


@pytest.mark.parametrize("law", ["gumbel", "normal"])
@pytest.mark.parametrize("rate", [0.05, 0.01])
def test_noise_exceeds_the_bound_at_most_as_often_as_stated(law: str, rate: float) -> None:
    rng = np.random.default_rng(5)
    alarms = []
    for _ in range(200):
        values = 0.0006 + 0.00005 * getattr(rng, law)(size=1020)
        calibration = calibrate_rest(values[:20], DELTA_M, rate)
        mu = values[20:] - calibration.mean_m
        alarms.append(np.mean(mu > calibration.noise_bound_m))
    assert np.mean(alarms) <= rate


def test_small_noise_keeps_the_scenes_thresholds() -> None:
    rng = np.random.default_rng(0)
    calibration = calibrate_rest(list(0.0006 + 0.00005 * rng.normal(size=20)), DELTA_M)
    assert calibration.delta_m == DELTA_M
    assert calibration.noise_bound_m < 0.002
    assert [calibration.state(mu) for mu in (0.0, 0.0021, 0.0041, 0.0061)] == [0, 1, 2, 3]
    assert calibration.mu_m(0.0001) == 0.0
    assert np.isnan(calibration.mu_m(float("nan")))
    assert "first warning at 2.00 mm" in str(calibration)


def test_large_noise_moves_all_thresholds_up_in_order() -> None:
    rng = np.random.default_rng(0)
    calibration = calibrate_rest(list(0.003 + 0.001 * rng.normal(size=20)), DELTA_M)
    assert calibration.delta_m[0] == pytest.approx(calibration.noise_bound_m)
    np.testing.assert_allclose(np.diff(calibration.delta_m), 0.002)


def test_too_few_frames_and_an_impossible_rate_are_refused() -> None:
    with pytest.raises(ValueError, match="2 usable rest frames"):
        calibrate_rest([0.001, 0.001, float("nan")], DELTA_M)
    with pytest.raises(ValueError, match="between 0 and 1"):
        calibrate_rest([0.001] * 10, DELTA_M, 0.0)
