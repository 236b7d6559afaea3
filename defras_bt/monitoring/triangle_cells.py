"""Triangles by the cubes that they may reach into, so that those near a point are found fast.

Each triangle is listed in every cube that its box meets. However a triangle is stretched, it
burdens no search but those in its own cubes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

_MAX_CELLS_PER_TRIANGLE = 4
# Sides of cubes to the mean length of a triangle's box, measured: wider ones list more triangles,
# narrower ones list each triangle more often.
_SIDE = 0.7


class TriangleCells(NamedTuple):
    """Cube c lists the triangles ``listed[first[c] : first[c + 1]]``.

    Cubes are counted along z, then y, then x. ``low_m`` (3,) is the lowest corner of the first,
    ``side_m`` their side, ``shape`` how many there are along each axis.
    """

    first: NDArray[np.int64]
    listed: NDArray[np.int64]
    low_m: Floats
    side_m: float
    shape: tuple[int, int, int]


@jit
def triangle_cells(corners_m: Floats) -> TriangleCells:
    """List finite triangles (m, 3, 3), m > 0, by cubes."""
    boxes, low, high, mean_m = _boxes(corners_m)
    side = max(_SIDE * mean_m, 1e-9)
    most = float(_MAX_CELLS_PER_TRIANGLE * len(corners_m) + 64)
    while True:
        cubes = 1.0
        for k in range(3):
            cubes *= np.floor((high[k] - low[k]) / side) + 1.0
        if cubes <= most:
            break
        side *= 1.3
    nx, ny, nz = (
        int((high[0] - low[0]) / side) + 1,
        int((high[1] - low[1]) / side) + 1,
        int((high[2] - low[2]) / side) + 1,
    )
    most_of = (nx - 1, ny - 1, nz - 1)
    per_m, spans = 1.0 / side, np.empty((len(boxes), 6), np.int64)
    first = np.zeros(nx * ny * nz + 1, np.int64)
    for t in range(len(boxes)):
        for k in range(3):
            spans[t, k] = min(int((boxes[t, k] - low[k]) * per_m), most_of[k])
            spans[t, 3 + k] = min(int((boxes[t, 3 + k] - low[k]) * per_m), most_of[k])
        for x in range(spans[t, 0], spans[t, 3] + 1):
            for y in range(spans[t, 1], spans[t, 4] + 1):
                for z in range(spans[t, 2], spans[t, 5] + 1):
                    first[(x * ny + y) * nz + z + 1] += 1
    for c in range(1, len(first)):
        first[c] += first[c - 1]
    place, listed = first[:-1].copy(), np.empty(first[-1], np.int64)
    for t in range(len(boxes)):
        for x in range(spans[t, 0], spans[t, 3] + 1):
            for y in range(spans[t, 1], spans[t, 4] + 1):
                for z in range(spans[t, 2], spans[t, 5] + 1):
                    cube = (x * ny + y) * nz + z
                    listed[place[cube]] = t
                    place[cube] += 1
    return TriangleCells(first, listed, low, side, (nx, ny, nz))


@jit
def _boxes(corners_m: Floats) -> tuple[Floats, Floats, Floats, float]:
    """Lowest and highest coordinates of each triangle (m, 6) and of all, and their mean length."""
    boxes, lengths = np.empty((len(corners_m), 6)), 0.0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for t in range(len(corners_m)):
        longest = 0.0
        for k in range(3):
            a, b, c = corners_m[t, 0, k], corners_m[t, 1, k], corners_m[t, 2, k]
            least, most = min(a, b, c), max(a, b, c)
            boxes[t, k], boxes[t, 3 + k] = least, most
            low[k], high[k] = min(low[k], least), max(high[k], most)
            longest = max(longest, most - least)
        lengths += longest
    return boxes, low, high, lengths / len(corners_m)
