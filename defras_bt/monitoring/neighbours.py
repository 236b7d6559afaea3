"""Nearest points of a cloud, and medians over neighbourhoods in it."""

from __future__ import annotations

import numpy as np

from defras_bt.monitoring.cells import (
    home,
    last_ring,
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
    cells = sorted_into_cells(points_m, radius_m)
    ranges, count = range_buffer(cells), len(points_m)
    square, value = np.empty(count), np.empty(count)
    ordered, reach = values[cells.order], radius_m * radius_m
    worst, known = -np.inf, 0
    for at in range(count):
        x, y, z = cells.points_m[at, 0], cells.points_m[at, 1], cells.points_m[at, 2]
        cube, _, _ = home(cells, cells.points_m[at])
        found = 0
        # A ring is as wide as the radius or wider, so none but the first can hold a neighbour.
        for ring in range(2):
            for r in range(ring_ranges(cells, cube, ring, ranges)):
                for other in range(ranges[r, 0], ranges[r, 1]):
                    u = cells.points_m[other, 0] - x
                    v = cells.points_m[other, 1] - y
                    w = cells.points_m[other, 2] - z
                    # Written always and kept if near: processors guess badly which are.
                    apart = u * u + v * v + w * w
                    square[found], value[found] = apart, ordered[other]
                    found += int(apart < reach)
        if found < least:
            continue
        known += 1
        if found > most:
            _nearest_first(square, value, found, most)
            found = most
        above = 0
        for i in range(found):
            above += value[i] > worst
        # A median is above what half of its values are above.
        if above >= found - found // 2:
            worst = max(worst, _median(value, found))
    return worst if known > 0 else np.nan, known


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
