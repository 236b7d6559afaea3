"""Points sorted into cubes, so that those near a place are found without looking at all.

A search goes from the cube a place lies in to the cubes around it, ring by ring; ``ring_m`` says
how near a point of the next ring can be at best, which proves when the search may stop.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

_MAX_CELLS_PER_POINT = 8


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
def ring_ranges(
    cells: Cells, cube: tuple[int, int, int], ring: int, ranges: NDArray[np.int64]
) -> int:
    """Write ranges (first, end) of ``cells.points_m`` in the ring around ``cube``; return how many.

    Ring 0 is the cube, ring r the cubes r away along one axis and no farther along the others.
    ``ranges`` is a buffer from :func:`range_buffer`. Cubes that follow each other in z hold points
    that follow each other: each column of cubes gives one range, or two where the ring is hollow.
    """
    count = 0
    low, high = cube[2] - ring, cube[2] + ring
    for x in range(max(cube[0] - ring, 0), min(cube[0] + ring + 1, cells.shape[0])):
        for y in range(max(cube[1] - ring, 0), min(cube[1] + ring + 1, cells.shape[1])):
            column = (x * cells.shape[1] + y) * cells.shape[2]
            if max(abs(x - cube[0]), abs(y - cube[1])) == ring:
                top = column + min(high, cells.shape[2] - 1)
                ranges[count, 0] = cells.first[column + max(low, 0)]
                ranges[count, 1] = cells.first[top + 1]
                count += 1
                continue
            for z in (low, high):
                if 0 <= z < cells.shape[2]:
                    ranges[count, 0] = cells.first[column + z]
                    ranges[count, 1] = cells.first[column + z + 1]
                    count += 1
    return count


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
def range_buffer(cells: Cells) -> NDArray[np.int64]:
    """Room for what :func:`ring_ranges` writes."""
    return np.empty((2 * cells.shape[0] * cells.shape[1], 2), np.int64)


@jit
def home(cells: Cells, at: Floats) -> tuple[tuple[int, int, int], float, float]:
    """The cube nearest to a place (3,), and what :func:`ring_m` asks for.

    These are the least distance of the box's nearest place to a neighbouring cube, and the square
    of the distance to the box of all cubes, 0 for a place in it.
    """
    x, in_x, out_x = _along(cells, at[0], 0)
    y, in_y, out_y = _along(cells, at[1], 1)
    z, in_z, out_z = _along(cells, at[2], 2)
    return (x, y, z), min(in_x, in_y, in_z), out_x**2 + out_y**2 + out_z**2


@jit
def _along(cells: Cells, at_m: float, axis: int) -> tuple[int, float, float]:
    along = at_m - cells.low_m[axis]
    nearest = min(max(along, 0.0), cells.shape[axis] * cells.side_m)
    cube = min(int(nearest / cells.side_m), cells.shape[axis] - 1)
    # Beyond the outermost cubes there is nothing that could be near.
    below = nearest - cube * cells.side_m if cube > 0 else np.inf
    above = (cube + 1) * cells.side_m - nearest if cube < cells.shape[axis] - 1 else np.inf
    return cube, max(min(below, above), 0.0), along - nearest


@jit
def ring_m(cells: Cells, ring: int, inside_m: float, outside_square: float) -> float:
    """No point in ring ``ring`` >= 1 or beyond is nearer to a place than this; see :func:`home`.

    The box of all cubes is convex, so the way from its nearest point onwards to any point in it
    makes no acute angle with the way there: squares of both add up to no more than the distance's.
    """
    return np.sqrt(((ring - 1) * cells.side_m + inside_m) ** 2 + outside_square)


@jit
def last_ring(cells: Cells) -> int:
    """No cube is in a ring beyond this."""
    return max(cells.shape[0], cells.shape[1], cells.shape[2])
