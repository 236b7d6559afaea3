"""The neighbourhood of a cloud that is farthest from a surface, by the median of its distances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.cells import extent_m, neighbour_ranges, sorted_into_cells
from defras_bt.monitoring.closest import SortedTriangles, near, nearest_of_all, sorted_triangles
from defras_bt.monitoring.triangles import bound
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit


@jit
def worst_median_m(
    points_m: Floats, corners_m: Floats, radius_m: float, least: int, most: int
) -> tuple[float, int]:
    """Largest median, over the neighbourhood of any point, of the distances to triangles.

    Points (n, 3) and triangles (m, 3, 3), both finite and more than none. Neighbours are less than
    ``radius_m`` away; each point is its own. Of more than ``most`` of them the nearest count; a
    point with fewer than ``least`` does not count. NaN if none does; also how many count.

    A distance is searched for to its end only where it could matter: what the search near a point
    finds is never too small, and so is the median of such bounds.
    """
    cells = sorted_into_cells(_longest_last(points_m), radius_m)
    places, order, among = cells.points_m.T.copy(), cells.order, sorted_triangles(corners_m)
    value, triangle = np.empty(len(order)), np.empty(len(order), np.int64)
    known, guess = np.empty(len(order), np.bool_), 0
    for i in range(len(order)):
        p = (points_m[order[i], 0], points_m[order[i], 1], points_m[order[i], 2])
        square, over = bound(p, among.planes, guess)
        if over:
            known[i] = False
        else:
            square, guess, known[i] = near(p, among, guess)
        value[i], triangle[i] = np.sqrt(square), guess
    buffer, ranges = np.empty((2, len(value))), np.empty((9, 2), np.int64)
    # Where the largest value is, a large median is likely: few others can compete with that.
    likely = np.argmax(value)
    worst, counting = -np.inf, 0
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
                counting += int(everywhere)
                # A median is above what half of its values are above.
                if 2 * above < min(found, most):
                    continue
                median = _median_at(places, value, i, columns, radius_m, most, buffer)
                if median > worst:
                    _search_on(points_m, order, among, columns, value, triangle, known)
                    median = _median_at(places, value, i, columns, radius_m, most, buffer)
                    worst = max(worst, median)
    return worst if counting > 0 else np.nan, counting


@jit
def _search_on(
    points_m: Floats,
    order: NDArray[np.int64],
    among: SortedTriangles,
    ranges: NDArray[np.int64],
    value: Floats,
    triangle: NDArray[np.int64],
    known: NDArray[np.bool_],
) -> None:
    """Make the distances of all points in ``ranges`` (r, 2) exact."""
    for r in range(len(ranges)):
        for j in range(ranges[r, 0], ranges[r, 1]):
            if not known[j]:
                p = (points_m[order[j], 0], points_m[order[j], 1], points_m[order[j], 2])
                square, _ = nearest_of_all(p, among, value[j] ** 2, triangle[j])
                value[j], known[j] = min(value[j], np.sqrt(square)), True


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
