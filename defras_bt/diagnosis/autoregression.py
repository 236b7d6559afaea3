"""Autoregressions: their partial autocorrelations, and how successive values vary together."""

from __future__ import annotations

import numpy as np
from scipy.linalg import toeplitz

from defras_sim.geometry import Floats


def partial_autocorrelations(ar: Floats) -> Floats:
    """Of an autoregression ``ar`` (p,), by Levinson's recursion backwards; it is stationary if
    all are within (-1, 1)."""
    left = np.array(ar, dtype=float)
    found = np.zeros(len(left))
    for order in range(len(left), 0, -1):
        last = left[order - 1]
        found[order - 1] = last
        if abs(last) >= 1.0:
            return found
        left = (left[: order - 1] + last * left[: order - 1][::-1]) / (1.0 - last**2)
    return found


def autoregression(partial: Floats) -> Floats:
    """The autoregression (p,) with these partial autocorrelations (p,)."""
    ar = np.zeros(0)
    for last in partial:
        ar = np.append(ar - last * ar[::-1], last)
    return ar


def stationary_variance(ar: Floats, innovation_sd: float) -> float:
    """Variance of the process; infinite where it does not stay where it is."""
    partial = partial_autocorrelations(ar)
    if np.any(np.abs(partial) >= 1.0):
        return float(np.inf)
    return float(innovation_sd**2 / np.prod(1.0 - partial**2))


def stationary_covariance(ar: Floats, innovation_sd: float) -> Floats:
    """Covariance (p, p) of p successive values of a stationary process."""
    partial = partial_autocorrelations(ar)
    left = stationary_variance(ar, innovation_sd)
    covariance = [left]
    lower = np.zeros(0)
    for last in partial[:-1]:
        covariance.append(float(last * left + lower @ np.array(covariance[1:])[::-1]))
        lower = np.append(lower - last * lower[::-1], last)
        left *= 1.0 - last**2
    return np.asarray(toeplitz(covariance))
