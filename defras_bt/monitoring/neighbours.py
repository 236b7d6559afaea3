"""Nearest points of a cloud, and medians over neighbourhoods in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.cells import (
    extent_m,
    home,
    last_ring,
    neighbour_ranges,
    range_buffer,
    ring_m,
    ring_ranges,
    sorted_into_cells,
    spacing_m,
)
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit


@jit
def nearest_m(points_m: Floats, others_m: Floats) -> Floats:
    """Distance (n,) of each of ``points_m`` (n, 3) to the nearest of ``others_m`` (m, 3), m > 0."""
    # Two points to a cube of a sheet: fewer are more cubes to look into, more are more points.
    cells = sorted_into_cells(others_m, np.sqrt(2.0) * spacing_m(others_m))
    distance, ranges, rings = np.empty(len(points_m)), range_buffer(cells), last_ring(cells)
    for i in range(len(points_m)):
        x, y, z = points_m[i, 0], points_m[i, 1], points_m[i, 2]
        cube, inside, outside = home(cells, points_m[i])
        best = np.inf
        for ring in range(rings):
            if ring > 0 and ring_m(cells, ring, inside, outside) ** 2 > best:
                break
            for r in range(ring_ranges(cells, cube, ring, ranges)):
                for at in range(ranges[r, 0], ranges[r, 1]):
                    u = cells.points_m[at, 0] - x
                    v = cells.points_m[at, 1] - y
                    w = cells.points_m[at, 2] - z
                    best = min(best, u * u + v * v + w * w)
        distance[i] = np.sqrt(best)
    return distance


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
