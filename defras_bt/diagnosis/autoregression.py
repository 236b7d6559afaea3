"""Autoregressions: their partial autocorrelations, and how successive values vary together.

Compiled: a diagnosis asks for them a million times.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from defras_sim.geometry import Floats


@njit(cache=True, nogil=True)
def partial_autocorrelations(ar: Floats) -> Floats:
    """Of an autoregression ``ar`` (p,), by Levinson's recursion backwards; it is stationary if
    all are within (-1, 1)."""
    left = ar.copy()
    found = np.zeros(len(ar))
    for order in range(len(ar), 0, -1):
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


@njit(cache=True, nogil=True)
def stationary_variance(ar: Floats, innovation_sd: float) -> float:
    """Variance of the process; infinite where it does not stay where it is."""
    left = 1.0
    for last in partial_autocorrelations(ar):
        if abs(last) >= 1.0:
            return np.inf
        left *= 1.0 - last**2
    return innovation_sd**2 / left


@njit(cache=True, nogil=True)
def stationary_covariance(ar: Floats, innovation_sd: float) -> Floats:
    """Covariance (p, p) of p successive values of a stationary process."""
    count = len(ar)
    if count == 0:
        return np.zeros((0, 0))
    partial = partial_autocorrelations(ar)
    covariance = np.zeros(count)
    left = stationary_variance(ar, innovation_sd)
    covariance[0] = left
    lower = np.zeros(0)
    for order in range(count - 1):
        last = partial[order]
        following = last * left
        for lag in range(order):
            following += lower[lag] * covariance[order - lag]
        covariance[order + 1] = following
        longer = np.empty(order + 1)
        longer[:order] = lower - last * lower[::-1]
        longer[order] = last
        lower = longer
        left *= 1.0 - last**2
    found = np.empty((count, count))
    for i in range(count):
        for j in range(count):
            found[i, j] = covariance[abs(i - j)]
    return found


@njit(cache=True, nogil=True)
def tamed(ar: Floats, innovation_sd: float, most: float, finely: float) -> Floats:
    """``ar`` (p,) with its roots pulled inwards, all by the same share, until the variance of the
    process is at most ``most``; ``finely`` is how well that share is found."""
    tame, wild = 0.0, 1.0
    if stationary_variance(ar, innovation_sd) <= most:
        return ar.copy()
    while wild - tame > finely:
        middle = 0.5 * (wild + tame)
        if stationary_variance(_pulled(ar, middle), innovation_sd) <= most:
            tame = middle
        else:
            wild = middle
    return _pulled(ar, tame)


@njit(cache=True, nogil=True)
def _pulled(ar: Floats, share: float) -> Floats:
    found = ar.copy()
    factor = 1.0
    for lag in range(len(ar)):
        factor *= share
        found[lag] *= factor
    return found
