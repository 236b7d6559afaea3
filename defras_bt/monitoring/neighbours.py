"""Nearest points of a cloud, and medians over neighbourhoods in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.cells import (
    cube_at,
    extent_m,
    inside,
    neighbour_ranges,
    reach,
    sorted_into_cells,
    spacing_m,
)
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

Point = tuple[float, float, float]


# Sides of cubes to distances of points, measured: fewer points in a cube are more cubes to look
# into, more are more points.
_SIDE = 2.8


@jit
def nearest_m(points_m: Floats, others_m: Floats) -> Floats:
    """Distance (n,) of each of ``points_m`` (n, 3) to the nearest of ``others_m`` (m, 3), m > 0."""
    cells = sorted_into_cells(others_m, _SIDE * spacing_m(others_m))
    places, first, low, per_m = cells.points_m, cells.first, cells.low_m, 1.0 / cells.side_m
    nx, ny, nz = cells.shape[0], cells.shape[1], cells.shape[2]
    distance, nearest = np.empty(len(points_m)), 0
    for i in range(len(points_m)):
        p = (points_m[i, 0], points_m[i, 1], points_m[i, 2])
        # Points follow each other along the rows of a picture: what was nearest is near again.
        best = _square(places, nearest, p)
        x, y, z = (p[0] - low[0]) * per_m, (p[1] - low[1]) * per_m, (p[2] - low[2]) * per_m
        own = (cube_at(x, nx) * ny + cube_at(y, ny)) * nz + cube_at(z, nz)
        best, nearest = _nearer(places, first[own], first[own + 1], p, best, nearest)
        most = reach(best, per_m)
        for column_x in range(cube_at(x - most, nx), cube_at(x + most, nx) + 1):
            beside_x = max(-inside(x, column_x), 0.0) ** 2
            half = np.sqrt(max(most**2 - beside_x, 0.0))
            for column_y in range(cube_at(y - half, ny), cube_at(y + half, ny) + 1):
                left = most**2 - beside_x - max(-inside(y, column_y), 0.0) ** 2
                if left < 0.0:
                    continue
                column, half = (column_x * ny + column_y) * nz, np.sqrt(left)
                start = first[column + cube_at(z - half, nz)]
                end = first[column + cube_at(z + half, nz) + 1]
                best, nearest = _nearer(places, start, end, p, best, nearest)
                most = reach(best, per_m)
        distance[i] = np.sqrt(best)
    return distance


@jit
def _nearer(
    places: Floats, start: int, end: int, p: Point, best: float, nearest: int
) -> tuple[float, int]:
    """Least square of a distance, and whose, after ``places[start:end]``."""
    for at in range(start, end):
        square = _square(places, at, p)
        if square < best:
            best, nearest = square, at
    return best, nearest


@jit
def _square(places: Floats, at: int, p: Point) -> float:
    x, y, z = places[at, 0] - p[0], places[at, 1] - p[1], places[at, 2] - p[2]
    return x * x + y * y + z * z


@jit
def worst_median(
    points_m: Floats, values: Floats, radius_m: float, least: int, most: int
) -> tuple[float, int]:
    """Largest median of ``values`` (n,) over the neighbourhood of any point (n, 3); how many count.

    Neighbours are less than ``radius_m`` away; each point is its own. Of more than ``most`` of them
    the nearest count; a point with fewer than ``least`` does not count. NaN if none does.
    """
    cells = sorted_into_cells(_longest_last(points_m), radius_m)
    places, value = cells.points_m.T.copy(), values[cells.order]
    buffer, ranges = np.empty((2, len(value))), np.empty((9, 2), np.int64)
    # Where the largest value is, a large median is likely: few others can compete with that.
    likely = np.argmax(value)
    worst, known = -np.inf, 0
    for everywhere in (False, True):
        for cube in range(len(cells.first) - 1):
            start, end = cells.first[cube], cells.first[cube + 1]
            if start == end or not (everywhere or start <= likely < end):
                continue
            columns = ranges[: neighbour_ranges(cells, cube, ranges)]
            for i in range(start, end):
                if not (everywhere or i == likely):
                    continue
                found, above = _counts(places, value, i, columns, radius_m, worst)
                if found < least:
                    continue
                known += int(everywhere)
                # A median is above what half of its values are above.
                if 2 * above >= min(found, most):
                    median = _median_at(places, value, i, columns, radius_m, most, buffer)
                    worst = max(worst, median)
    return worst if known > 0 else np.nan, known


@jit
def _longest_last(points_m: Floats) -> Floats:
    """The same points (n, 3) with axes exchanged: the last is that along which they reach farthest.

    Columns of cubes are then few and full.
    """
    low, high = extent_m(points_m)
    axes, turned = np.argsort(high - low), np.empty(points_m.shape)
    for i in range(len(points_m)):
        for k in range(3):
            turned[i, k] = points_m[i, axes[k]]
    return turned


@jit
def _counts(
    places: Floats, value: Floats, i: int, ranges: NDArray[np.int64], radius_m: float, limit: float
) -> tuple[int, int]:
    """How many neighbours point ``i`` of ``places`` (3, n) has, and of how many values > ``limit``.

    Counted in numbers that several fit into one register, over slices that compilers know the ends
    of: so it is done four at a time.
    """
    found = above = 0.0
    px, py, pz, reach = places[0, i], places[1, i], places[2, i], radius_m * radius_m
    for r in range(len(ranges)):
        start, end = ranges[r, 0], ranges[r, 1]
        x, y, z = places[0, start:end], places[1, start:end], places[2, start:end]
        values = value[start:end]
        for j in range(len(x)):
            u, v, w = x[j] - px, y[j] - py, z[j] - pz
            near = 1.0 if u * u + v * v + w * w < reach else 0.0
            found += near
            above += near if values[j] > limit else 0.0
    return int(found), int(above)


@jit
def _median_at(
    places: Floats,
    value: Floats,
    i: int,
    ranges: NDArray[np.int64],
    radius_m: float,
    most: int,
    buffer: Floats,
) -> float:
    """Median over the neighbourhood of point ``i``; ``buffer`` (2, n) is written to."""
    square, values, found = buffer[0], buffer[1], 0
    for r in range(len(ranges)):
        for j in range(ranges[r, 0], ranges[r, 1]):
            u = places[0, j] - places[0, i]
            v = places[1, j] - places[1, i]
            w = places[2, j] - places[2, i]
            apart = u * u + v * v + w * w
            if apart < radius_m * radius_m:
                square[found], values[found] = apart, value[j]
                found += 1
    if found > most:
        _nearest_first(square, values, found, most)
        found = most
    return _median(values, found)


@jit
def _nearest_first(square: Floats, value: Floats, count: int, most: int) -> None:
    """Put the ``most`` nearest of the first ``count`` first, in any order (Hoare's selection)."""
    low, high = 0, count - 1
    while low < high:
        pivot, i, j = square[(low + high) // 2], low, high
        while i <= j:
            while square[i] < pivot:
                i += 1
            while square[j] > pivot:
                j -= 1
            if i <= j:
                square[i], square[j] = square[j], square[i]
                value[i], value[j] = value[j], value[i]
                i += 1
                j -= 1
        if most - 1 <= j:
            high = j
        elif most - 1 >= i:
            low = i
        else:
            return


@jit
def _median(values: Floats, count: int) -> float:
    """Median of the first ``count`` of a few values, which are sorted on the way."""
    for i in range(1, count):
        value, place = values[i], i
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value
    return (values[(count - 1) // 2] + values[count // 2]) / 2
