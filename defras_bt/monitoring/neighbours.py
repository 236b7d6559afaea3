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
        p, best = points_m[i], np.inf
        cube, inside, outside = home(cells, p)
        for ring in range(rings):
            if ring > 0 and ring_m(cells, ring, inside, outside) ** 2 > best:
                break
            for r in range(ring_ranges(cells, cube, ring, ranges)):
                for at in range(ranges[r, 0], ranges[r, 1]):
                    q = cells.points_m[at]
                    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
                    best = min(best, x * x + y * y + z * z)
        distance[i] = np.sqrt(best)
    return distance


@jit
def neighbourhood_medians(
    points_m: Floats, values: Floats, radius_m: float, least: int, most: int
) -> Floats:
    """Median (n,) of ``values`` (n,) over the points (n, 3) less than ``radius_m`` away.

    Each point is its own neighbour. Of more than ``most`` neighbours the nearest count; of fewer
    than ``least`` there is no median, but NaN.
    """
    cells = sorted_into_cells(points_m, radius_m)
    ranges, count = range_buffer(cells), len(points_m)
    # A ring is as wide as the radius or wider, so none but the first can hold a neighbour.
    square, value = np.empty(most), np.empty(most)
    medians = np.full(count, np.nan)
    for at in range(count):
        p, found = cells.points_m[at], 0
        cube, _, _ = home(cells, p)
        for ring in range(2):
            for r in range(ring_ranges(cells, cube, ring, ranges)):
                for other in range(ranges[r, 0], ranges[r, 1]):
                    q = cells.points_m[other]
                    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
                    apart = x * x + y * y + z * z
                    if apart >= radius_m * radius_m:
                        continue
                    if found < most:
                        place, found = found, found + 1
                    else:
                        place = int(np.argmax(square))
                        if apart >= square[place]:
                            continue
                    square[place], value[place] = apart, values[cells.order[other]]
        if found >= least:
            medians[cells.order[at]] = _median(value, found)
    return medians


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
