"""What is asked of every series of a layout, compiled: a diagnosis asks it thousands of times."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from defras_bt.diagnosis.autoregression import stationary_covariance
from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.whitening import filtered
from defras_sim.geometry import Floats


@njit(cache=True, nogil=True)
def whitened(
    values: Floats,
    seen: NDArray[np.bool_],
    ends: Integers,
    slot: Integers,
    ar: Floats,
    order: Integers,
    innovation_sd: Floats,
) -> Floats:
    """Innovations of ``values`` (n, k) where they are ``seen`` (n,), zero elsewhere.

    ``ends`` (s, 2): first row of each series and the one after its last, sampled at steps ``slot``
    (n,). Noise of each series: the first ``order`` (s,) numbers of ``ar`` (s, p) and
    ``innovation_sd`` (s,).
    """
    found = np.zeros(values.shape)
    for one in range(len(ends)):
        rows = ends[one, 0] + np.flatnonzero(seen[ends[one, 0] : ends[one, 1]])
        if not len(rows):
            continue
        own = values[rows]
        if order[one]:
            past, sd = ar[one, : order[one]].copy(), innovation_sd[one]
            new = filtered(own, slot[rows], past, sd**2, stationary_covariance(past, sd))
        else:
            new = own / innovation_sd[one]
        for row in range(len(rows)):
            found[rows[row]] = new[row]
    return found


@njit(cache=True, nogil=True)
def lagged_products(
    values: Floats,
    seen: NDArray[np.bool_],
    ends: Integers,
    slot: Integers,
    channel: Integers,
    channels: int,
    order: int,
) -> tuple[Floats, Floats]:
    """Sums (c, order+1, order+1) of products of values that follow each other without a gap, the
    newest first, and of how many such runs (c,). ``channel`` (s,) of each series."""
    total = np.zeros((channels, order + 1, order + 1))
    runs = np.zeros(channels)
    for one in range(len(ends)):
        c = channel[one]
        unbroken, last = 0, -2
        for row in range(ends[one, 0], ends[one, 1]):
            if not seen[row]:
                continue
            unbroken = unbroken + 1 if slot[row] == last + 1 else 1
            last = slot[row]
            if unbroken <= order:
                continue
            runs[c] += 1
            # Rows between are all seen, or there would have been a gap.
            for i in range(order + 1):
                for j in range(i + 1):
                    total[c, i, j] += values[row - i] * values[row - j]
    for c in range(channels):
        for i in range(order + 1):
            for j in range(i):
                total[c, j, i] = total[c, i, j]
    return total, runs


@njit(cache=True, nogil=True)
def robust_sds(
    values: Floats, seen: NDArray[np.bool_], channel: Integers, channels: int, largest: float
) -> Floats:
    """Of each channel (c,): see :func:`robust_sd`; ``channel`` (n,) of each value."""
    count = np.zeros(channels + 1, np.int64)
    for row in range(len(values)):
        if seen[row]:
            count[channel[row] + 1] += 1
    first = np.cumsum(count)
    sorted_by_channel, at = np.empty(first[-1]), first[:-1].copy()
    for row in range(len(values)):
        if seen[row]:
            sorted_by_channel[at[channel[row]]] = values[row]
            at[channel[row]] += 1
    found = np.zeros(channels)
    for c in range(channels):
        found[c] = robust_sd(sorted_by_channel[first[c] : first[c + 1]], largest)
    return found


@njit(cache=True, nogil=True)
def robust_sd(values: Floats, largest: float) -> float:
    """Root mean square about zero, outliers pulled in to ``largest`` robust standard deviations."""
    if not len(values):
        return 0.0
    most = largest * 1.4826 * np.median(np.abs(values))
    total = 0.0
    for value in values:
        pulled = min(max(value, -most), most) if most > 0.0 else value
        total += pulled**2
    return np.sqrt(total / len(values))
