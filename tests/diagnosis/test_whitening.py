"""Innovations against the Cholesky factor of the dense covariance, gaps included."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz

from defras_bt.diagnosis.autoregression import autoregression, stationary_covariance
from defras_bt.diagnosis.whitening import filtered
from defras_sim.geometry import Floats


def _covariance(ar: Floats, innovation_sd: float, length: int) -> Floats:
    """From the impulse response, truncated where it has died out."""
    response = np.zeros(6000)
    response[0] = innovation_sd
    for t in range(1, len(response)):
        response[t] = sum(a * response[t - lag] for lag, a in enumerate(ar, 1) if t >= lag)
    lags = [float(response[: len(response) - k] @ response[k:]) for k in range(length)]
    return np.asarray(toeplitz(lags))


@pytest.mark.parametrize("partial", [[0.9], [0.7, -0.5], [0.9, -0.3, 0.2, 0.1]])
def test_whitens_as_the_inverse_of_the_cholesky_factor_does(partial: list[float]) -> None:
    rng = np.random.default_rng(1)
    ar = autoregression(np.array(partial))
    slot = np.flatnonzero(rng.random(120) > 0.3)
    slot = slot - slot[0]
    covariance = _covariance(ar, 0.4, int(slot[-1]) + 1)[np.ix_(slot, slot)]
    values = rng.standard_normal((len(slot), 3))
    expected = np.linalg.solve(np.linalg.cholesky(covariance), values)
    found = filtered(values, slot, ar, 0.4**2, stationary_covariance(ar, 0.4))
    assert np.allclose(found, expected, atol=1e-9)
