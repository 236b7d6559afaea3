"""Points sorted into cubes, so that those near a place are found without looking at all.

A search starts with what is in the cube nearest to a place, and then looks into every other cube
that is nearer than the best so far.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

_MAX_CELLS_PER_POINT = 8
ROUNDING = 1e-9


class Cells(NamedTuple):
    """Points by cube: cube c holds ``points_m[first[c] : first[c + 1]]``, once ``order`` in all.

    ``points_m`` (n, 3) are sorted; ``order`` (n,) is where each stood before. ``low_m`` (3,) is the
    lowest corner, ``side_m`` the side of a cube, ``shape`` (3,) how many there are along each axis.
    """

    points_m: Floats
    order: NDArray[np.int64]
    first: NDArray[np.int64]
    low_m: Floats
    side_m: float
    shape: NDArray[np.int64]


@jit
def extent_m(points_m: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates (3,) of points (n, 3)."""
    low, high = points_m[0].copy(), points_m[0].copy()
    for i in range(len(points_m)):
        for k in range(3):
            low[k] = min(low[k], points_m[i, k])
            high[k] = max(high[k], points_m[i, k])
    return low, high


@jit
def spacing_m(points_m: Floats) -> float:
    """About how far points (n, 3) of a sheet are from each other; above 0."""
    low, high = extent_m(points_m)
    x, y, z = high - low
    area = max(x * y, y * z, z * x)
    count = len(points_m)
    return max(np.sqrt(area / count), max(x, y, z) / count, 1e-9)


@jit
def sorted_into_cells(points_m: Floats, side_m: float) -> Cells:
    """Sort finite points (n, 3), n > 0, into cubes of ``side_m``, or wider if those were many."""
    count = len(points_m)
    low, high = extent_m(points_m)
    side, most = side_m, float(_MAX_CELLS_PER_POINT * count + 64)
    while True:
        cubes = 1.0
        for k in range(3):
            cubes *= np.floor((high[k] - low[k]) / side) + 1.0
        if cubes <= most:
            break
        side *= 1.5
    shape = np.empty(3, np.int64)
    for k in range(3):
        shape[k] = int((high[k] - low[k]) / side) + 1
    first = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    cube = np.empty(count, np.int64)
    for i in range(count):
        x = int((points_m[i, 0] - low[0]) / side)
        y = int((points_m[i, 1] - low[1]) / side)
        z = int((points_m[i, 2] - low[2]) / side)
        cube[i] = (x * shape[1] + y) * shape[2] + z
        first[cube[i] + 1] += 1
    for c in range(1, len(first)):
        first[c] += first[c - 1]
    place, order, points = first[:-1].copy(), np.empty(count, np.int64), np.empty((count, 3))
    for i in range(count):
        at = place[cube[i]]
        place[cube[i]] += 1
        order[at] = i
        for k in range(3):
            points[at, k] = points_m[i, k]
    return Cells(points, order, first, low, side, shape)


@jit
def neighbour_ranges(cells: Cells, cube: int, ranges: NDArray[np.int64]) -> int:
    """Write ranges of the points in cube number ``cube`` and those around it; return how many.

    There are at most 9 of them, one for each column of cubes that holds any point.
    """
    nx, ny, nz = cells.shape[0], cells.shape[1], cells.shape[2]
    x, y, z = cube // (ny * nz), cube // nz % ny, cube % nz
    count = 0
    for column_x in range(max(x - 1, 0), min(x + 2, nx)):
        for column_y in range(max(y - 1, 0), min(y + 2, ny)):
            column = (column_x * ny + column_y) * nz
            start = cells.first[column + max(z - 1, 0)]
            end = cells.first[column + min(z + 2, nz)]
            if start < end:
                ranges[count, 0], ranges[count, 1] = start, end
                count += 1
    return count


@jit
def cube_at(along: float, count: int) -> int:
    """Number of the cube, of ``count`` along an axis, that is nearest to a place.

    Places along an axis are told in sides of cubes from the first one's lower end.
    """
    return min(max(int(along), 0), count - 1)


@jit
def inside(along: float, cube: int) -> float:
    """How far inside a cube a place is, along one axis; negative: how far beside it."""
    return min(along - cube, cube + 1.0 - along)


@jit
def reach(square_m2: float, per_m: float) -> float:
    """Only what is nearer than this, in sides of cubes, can be nearer than ``square_m2`` says.

    A little generous, so that rounding leaves nothing out. ``per_m``: one over the side.
    """
    return np.sqrt(square_m2) * per_m * (1.0 + ROUNDING) + ROUNDING
