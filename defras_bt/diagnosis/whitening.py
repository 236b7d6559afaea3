"""Innovations of autoregressive noise with gaps: exact, for many columns at once.

A Kalman filter whose state is the last p values. Its gains depend on where samples are missing and
not on the numbers, so they are computed once and applied to all columns (Jones 1980, *Maximum
likelihood fitting of ARMA models to time series with missing observations*).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats


@njit(cache=True, nogil=True)
def filtered(
    values: Floats, slot: Integers, ar: Floats, variance: float, covariance: Floats
) -> Floats:
    """What is new in each row of ``values`` (n, k) at steps ``slot`` (n,), in its own standard
    deviation: independent and of variance 1 if the columns are the noise of ``ar`` (p,).

    ``variance`` of its innovations, ``covariance`` (p, p) of p successive values.
    """
    rows, columns = values.shape
    order = len(ar)
    mean = np.zeros((order, columns))
    found = np.empty((rows, columns))
    exact = 0  # successive samples without a gap
    spread = covariance.copy()
    previous = -1
    for row in range(rows):
        gap = slot[row] - previous if previous >= 0 else 0
        previous = slot[row]
        if gap == 1 and exact >= order:
            # Everything that matters has been seen: the plain regression.
            newest = np.zeros(columns)
            for lag in range(order):
                for column in range(columns):
                    newest[column] += ar[lag] * mean[lag, column]
            for lag in range(order - 1, 0, -1):
                mean[lag] = mean[lag - 1]
            mean[0] = values[row]
            found[row] = (values[row] - newest) / np.sqrt(variance)
            continue
        if exact >= order:
            spread[:] = 0.0
        for _ in range(gap):
            newest = np.zeros(columns)
            for lag in range(order):
                for column in range(columns):
                    newest[column] += ar[lag] * mean[lag, column]
            for lag in range(order - 1, 0, -1):
                mean[lag] = mean[lag - 1]
            mean[0] = newest
            moved = np.zeros((order, order))
            for i in range(order):
                for j in range(order):
                    if i > 0 and j > 0:
                        moved[i, j] = spread[i - 1, j - 1]
                    elif i > 0:
                        for lag in range(order):
                            moved[i, 0] += spread[i - 1, lag] * ar[lag]
                    elif j > 0:
                        for lag in range(order):
                            moved[0, j] += ar[lag] * spread[lag, j - 1]
                    else:
                        for a in range(order):
                            for b in range(order):
                                moved[0, 0] += ar[a] * spread[a, b] * ar[b]
            moved[0, 0] += variance
            spread = moved
        new = values[row] - mean[0]
        expected = spread[0, 0]
        found[row] = new / np.sqrt(expected)
        gain = spread[:, 0] / expected
        for i in range(order):
            mean[i] += gain[i] * new
        spread = spread - np.outer(gain, spread[0])
        exact = exact + 1 if gap == 1 else 1
    return found
