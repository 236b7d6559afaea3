"""Autoregressions against scipy's Lyapunov solver."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from defras_bt.diagnosis.autoregression import (
    autoregression,
    partial_autocorrelations,
    stationary_covariance,
    stationary_variance,
)


@pytest.mark.parametrize("order", [1, 2, 3, 6, 8])
def test_partial_autocorrelations_and_back(order: int) -> None:
    partial = np.random.default_rng(order).uniform(-0.95, 0.95, order)
    assert np.allclose(partial_autocorrelations(autoregression(partial)), partial)


@pytest.mark.parametrize("order", [1, 2, 3, 6, 8])
def test_covariance_solves_lyapunov_s_equation(order: int) -> None:
    ar = autoregression(np.random.default_rng(order).uniform(-0.9, 0.9, order))
    step = np.eye(order, k=-1)
    step[0] = ar
    driving = np.zeros((order, order))
    driving[0, 0] = 0.3**2
    assert np.allclose(stationary_covariance(ar, 0.3), solve_discrete_lyapunov(step, driving))


def test_a_random_walk_goes_anywhere() -> None:
    assert stationary_variance(np.array([0.99]), 1.0) == pytest.approx(1.0 / (1.0 - 0.99**2))
    assert stationary_variance(np.array([1.0]), 1.0) == np.inf
    assert stationary_variance(np.array([1.2, -0.1]), 1.0) == np.inf
