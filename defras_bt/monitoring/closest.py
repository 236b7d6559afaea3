"""The closest point of a triangle surface, exactly, in a fifth of a millisecond for a cloud."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from defras_bt.monitoring.cells import ROUNDING, cube_at, inside, reach
from defras_bt.monitoring.triangle_cells import TriangleCells, triangle_cells
from defras_bt.monitoring.triangles import Point, bound, planes_of, square_to, weights_of
from defras_bt.sensing.usable import all_finite
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

# Searches call these for every point: a call costs as much as half of what it does.
inlined = njit(cache=True, nogil=True, inline="always")


@dataclass(frozen=True)
class Closest:
    """For each of n points: the distance (n,), the triangle's index (n,), and the place on it.

    ``weights`` (n, 3) are the barycentric coordinates of the closest point.
    """

    distance_m: Floats
    triangle: NDArray[np.int64]
    weights: Floats


def closest_on_triangles(points_m: Floats, corners_m: Floats) -> Closest:
    """Closest points of triangles ``corners_m`` (m, 3, 3) to ``points_m`` (n, 3).

    Nothing nearer is missed: a triangle is left out only if it reaches into no cube that is nearer
    than the best so far, or if a bound on its distance says so. Of several triangles equally near,
    as at an edge, the first counts.

    Raises:
        ValueError: there is no triangle, or a number is not finite.
    """
    points, corners = checked(points_m, corners_m)
    distance, triangle = _search(points, corners)
    return Closest(distance, triangle, _weights(points, corners, triangle))


def distance_to_triangles_m(points_m: Floats, corners_m: Floats) -> Floats:
    """Distances (n,) as :func:`closest_on_triangles` gives them, raising as it does."""
    distance, _ = _search(*checked(points_m, corners_m))
    return distance


def checked(points_m: Floats, corners_m: Floats) -> tuple[Floats, Floats]:
    """Points (n, 3) and triangles (m, 3, 3), m > 0, laid out for searches.

    Raises:
        ValueError: there is no triangle, or a number is not finite.
    """
    points = np.ascontiguousarray(points_m, float).reshape(-1, 3)
    corners = np.ascontiguousarray(corners_m, float).reshape(-1, 3, 3)
    if len(corners) == 0:
        raise ValueError("no triangles given: nothing is closest to a point")
    if not _both_finite(points, corners):
        raise ValueError("points and triangles should be finite; drop NaN points while sensing")
    return points, corners


@jit
def _both_finite(points: Floats, corners: Floats) -> bool:
    return all_finite(points) and all_finite(corners.reshape(-1, 3))


@jit
def _search(points: Floats, corners: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Distance (n,) to the closest triangle, and its index (n,)."""
    distance, index = np.empty(len(points)), np.empty(len(points), np.int64)
    among, nearest = sorted_triangles(corners), 0
    for i in range(len(points)):
        p = (points[i, 0], points[i, 1], points[i, 2])
        # Points follow each other along the rows of a picture: what was nearest is near again.
        square, nearest, surely = near(p, among, nearest)
        if not surely:
            square, nearest = nearest_of_all(p, among, square, nearest)
        distance[i], index[i] = np.sqrt(square), nearest
    return distance, index


class SortedTriangles(NamedTuple):
    """Triangles ``corners_m`` (m, 3, 3) as searches want them; ``bounds`` is scratch paper."""

    corners_m: Floats
    planes: Floats
    cells: TriangleCells
    bounds: Floats


@jit
def sorted_triangles(corners_m: Floats) -> SortedTriangles:
    """Prepare m > 0 finite triangles for searches."""
    cells = triangle_cells(corners_m)
    return SortedTriangles(corners_m, planes_of(corners_m), cells, np.empty(len(cells.listed)))


@inlined
def near(p: Point, among: SortedTriangles, guess: int) -> tuple[float, int, bool]:
    """Square of the distance to a triangle that is near, which, and whether it surely is nearest.

    Of ``guess`` and those that reach into the point's own cube it is the nearest.
    """
    cells, (nx, ny, nz) = among.cells, among.cells.shape
    nearest = guess
    square, known = bound(p, among.planes, nearest)
    if not known:
        square = square_to(p, among.corners_m, nearest)
    x, y, z = _in_sides(p, cells)
    own_x, own_y, own_z = cube_at(x, nx), cube_at(y, ny), cube_at(z, nz)
    own = (own_x * ny + own_y) * nz + own_z
    square, nearest = _nearer(p, among, cells.first[own], cells.first[own + 1], square, nearest)
    most = reach(square, 1.0 / cells.side_m)
    surely = most < min(inside(x, own_x), inside(y, own_y), inside(z, own_z))
    return square, nearest, surely


@inlined
def nearest_of_all(
    p: Point, among: SortedTriangles, square: float, nearest: int
) -> tuple[float, int]:
    """Square of the distance to the nearest triangle, and which, after what :func:`near` said."""
    cells, (nx, ny, nz) = among.cells, among.cells.shape
    first, per_m = cells.first, 1.0 / cells.side_m
    x, y, z = _in_sides(p, cells)
    most = reach(square, per_m)
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
            if start < end:
                square, nearest = _nearer(p, among, start, end, square, nearest)
                most = reach(square, per_m)
    return square, nearest


@jit
def _in_sides(p: Point, cells: TriangleCells) -> Point:
    """Where a point is, in sides of cubes from the lowest corner of the first."""
    low, per_m = cells.low_m, 1.0 / cells.side_m
    return (p[0] - low[0]) * per_m, (p[1] - low[1]) * per_m, (p[2] - low[2]) * per_m


@inlined
def _nearer(
    p: Point, among: SortedTriangles, start: int, end: int, square: float, nearest: int
) -> tuple[float, int]:
    """Square and triangle of the least distance, after those in ``listed[start:end]``.

    First those that the point is above or below, which most often settles the matter; the others
    are then measured only where their bound does not rule them out.
    """
    corners, planes, bounds = among.corners_m, among.planes, among.bounds
    listed = among.cells.listed
    for at in range(start, end):
        t = listed[at]
        least, known = bound(p, planes, t)
        bounds[at - start] = np.inf if known else least
        if known and (least < square or (least == square and t < nearest)):
            square, nearest = least, t
    for at in range(start, end):
        if bounds[at - start] <= square * (1.0 + ROUNDING) and listed[at] != nearest:
            t = listed[at]
            other = square_to(p, corners, t)
            if other < square or (other == square and t < nearest):
                square, nearest = other, t
    return square, nearest


@jit
def _weights(points: Floats, corners: Floats, triangle: NDArray[np.int64]) -> Floats:
    weights = np.empty((len(points), 3))
    for i in range(len(points)):
        p = (points[i, 0], points[i, 1], points[i, 2])
        weights[i, 0], weights[i, 1], weights[i, 2] = weights_of(p, corners, triangle[i])
    return weights
