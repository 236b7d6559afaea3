"""What a metric says over time, and what becomes of rest values that were wrong."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.monitoring.metric_track import MetricTrack

DELTA_M = (0.002, 0.004, 0.006)


def rested(value_m: float) -> MetricTrack:
    track = MetricTrack(DELTA_M)
    for jitter in np.linspace(-1e-5, 1e-5, 6):
        track.rest(value_m + jitter)
    track.calibrate()
    return track


def test_a_trusted_rest_value_stays() -> None:
    track = rested(0.003)
    track.take(0.001, 1.0)
    track.take(0.0045, 2.0)
    assert track.mu_m == pytest.approx(0.0015)


def test_an_error_that_was_mended_hides_no_other() -> None:
    track = rested(0.003)
    track.distrust_rest()
    track.take(0.0004, 1.0)
    assert track.mu_m == 0.0
    for stamp_s in (2.0, 3.0):
        track.take(0.0045, stamp_s)
    assert track.mu_m == pytest.approx(0.0041)
    assert track.state == 2


def test_a_distrusted_rest_value_is_never_raised() -> None:
    track = rested(0.0005)
    track.distrust_rest()
    track.take(0.003, 1.0)
    assert track.mu_m == pytest.approx(0.0025)
    track.take(float("nan"), 2.0)
    assert np.isnan(track.mu_m)


def test_without_rest_values_there_are_none_to_distrust() -> None:
    with pytest.raises(RuntimeError, match="none to distrust"):
        MetricTrack(DELTA_M).distrust_rest()
