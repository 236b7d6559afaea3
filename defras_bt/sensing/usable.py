"""Which points of a cloud can be used, in one pass over them."""

from __future__ import annotations

import numpy as np
from numba import njit

from defras_sim.geometry import Floats


@njit(cache=True, nogil=True)
def usable_points(points_m: Floats, low_m: Floats, high_m: Floats) -> tuple[Floats, int]:
    """Points (k, 3) of (n, 3) in a box, its sides included; and how many of the n were finite.

    Depth cameras measure, and recordings keep, no more than single precision: points are rounded
    to it, and what is too large for it counts as infinite.
    """
    kept, inside, finite = np.empty((len(points_m), 3)), 0, 0
    for i in range(len(points_m)):
        x = float(np.float32(points_m[i, 0]))
        y = float(np.float32(points_m[i, 1]))
        z = float(np.float32(points_m[i, 2]))
        if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(z)):
            continue
        finite += 1
        if low_m[0] <= x <= high_m[0] and low_m[1] <= y <= high_m[1] and low_m[2] <= z <= high_m[2]:
            kept[inside, 0], kept[inside, 1], kept[inside, 2] = x, y, z
            inside += 1
    return kept[:inside].copy(), finite


@njit(cache=True, nogil=True)
def all_finite(points_m: Floats) -> bool:
    """Whether every number of (n, k) is one."""
    for i in range(points_m.shape[0]):
        for k in range(points_m.shape[1]):
            if not np.isfinite(points_m[i, k]):
                return False
    return True
