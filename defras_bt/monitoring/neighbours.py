"""Nearest points of a cloud."""

from __future__ import annotations

import numpy as np

from defras_bt.monitoring.cells import (
    cube_at,
    inside,
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
