"""What is asked of every series, against the same said with arrays, series by series."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from defras_bt.diagnosis.autoregression import stationary_covariance
from defras_bt.diagnosis.layout import Layout, layout
from defras_bt.diagnosis.noise import Noise, estimate_noise
from defras_bt.diagnosis.series import lagged_products, robust_sd, robust_sds
from defras_bt.diagnosis.whitening import filtered
from defras_sim.geometry import Floats
from tests.diagnosis.toy_problem import toy


@pytest.fixture(scope="module")
def series() -> tuple[Layout, Floats, Noise]:
    """Two channels with gaps in the samples; of others the numbers are missing."""
    rng = np.random.default_rng(7)
    problem = toy(rng, {}, ar=(0.8,), gaps=0.2, length=200, channels=2)
    residual = problem.residual({})
    residual[rng.random(len(residual)) < 0.1] = np.nan
    found = layout(problem.samples)
    return found, residual, estimate_noise(residual, problem.samples, found)


@pytest.mark.parametrize("order", [0, 1, 3])
def test_lagged_products_are_those_of_runs_without_a_gap(
    series: tuple[Layout, Floats, Noise], order: int
) -> None:
    found, residual, _ = series
    seen = np.isfinite(residual)
    total, runs = lagged_products(residual, seen, found.ends, found.slot, found.channel, 2, order)
    expected, count = np.zeros_like(total), np.zeros(2)
    for one in found.series:
        dense = np.full(one.length, np.nan)
        dense[one.slot] = residual[one.rows]
        windows = sliding_window_view(dense, order + 1)[:, ::-1]
        windows = windows[np.isfinite(windows).all(axis=1)]
        expected[one.channel] += windows.T @ windows
        count[one.channel] += len(windows)
    np.testing.assert_allclose(total, expected)
    np.testing.assert_array_equal(runs, count)
    assert count.min() > 20


def test_a_series_shorter_than_the_order_gives_nothing() -> None:
    ends, slot, channel = np.array([[0, 3]]), np.arange(3), np.zeros(1, np.int64)
    total, runs = lagged_products(np.ones(3), np.ones(3, bool), ends, slot, channel, 1, 3)
    assert not total.any()
    assert not runs.any()


def test_every_series_is_whitened_by_the_noise_of_its_channel(
    series: tuple[Layout, Floats, Noise],
) -> None:
    found, residual, noise = series
    plain = replace(noise, weight=np.ones(len(residual)))
    columns = np.random.default_rng(8).standard_normal((len(residual), 3))
    white = plain.whiten(columns)
    assert not white[~noise.seen].any()
    for one in found.series:
        keep = noise.seen[one.rows]
        own = noise.channels[one.channel]
        assert len(own.ar)
        sd = own.innovation_sd
        expected = filtered(
            columns[one.rows][keep],
            one.slot[keep],
            own.ar,
            sd**2,
            stationary_covariance(own.ar, sd),
        )
        np.testing.assert_allclose(white[one.rows][keep], expected, atol=1e-12)


def test_without_autocorrelation_it_is_a_division(
    series: tuple[Layout, Floats, Noise],
) -> None:
    found, residual, noise = series
    white = tuple(replace(c, ar=np.zeros(0)) for c in noise.channels)
    plain = replace(noise, channels=white, weight=np.ones(len(residual)))
    sd = np.array([c.innovation_sd for c in noise.channels])
    rows = np.repeat(sd[found.channel], np.diff(found.ends, axis=1)[:, 0])
    white = plain.whiten(np.ones((len(residual), 1)))[:, 0]
    np.testing.assert_allclose(white, np.where(noise.seen, 1.0 / rows, 0.0))


def test_scatter_of_a_channel_is_about_zero_with_outliers_pulled_in() -> None:
    values = np.array([1.0, -1.0, 1.0, -1.0, 1000.0, 3.0, -3.0, np.nan])
    channel = np.array([0, 0, 0, 0, 0, 1, 1, 1])
    found = robust_sds(values, np.isfinite(values), channel, 3, 4.0)
    assert found[0] == pytest.approx(np.sqrt((4.0 + (4.0 * 1.4826) ** 2) / 5.0))
    assert found[1] == pytest.approx(3.0)
    assert found[2] == robust_sd(np.zeros(0), 4.0) == 0.0
    assert robust_sd(np.array([0.0, 0.0, 5.0]), 4.0) == pytest.approx(5.0 / np.sqrt(3.0))
