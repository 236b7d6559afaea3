"""The closest point of a triangle surface, exactly, in half a millisecond for a cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

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

# Bounds are compared a little generously, so that rounding leaves no triangle out; below so many
# squares of its size a triangle's area says nothing about its plane.
_ROUNDING = 1.0 + 1e-9
_FLAT = 1e-6


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

    Nothing nearer is missed: a triangle is left out only if the disc around it, in its plane about
    its centroid, is farther away than the best so far. Of several triangles equally near, as at an
    edge, the first counts. 1,300 points against 1,200 triangles need 0.6 ms.

    Raises:
        ValueError: there is no triangle, or a number is not finite.
    """
    points = np.ascontiguousarray(points_m, float).reshape(-1, 3)
    corners = np.ascontiguousarray(corners_m, float).reshape(-1, 3, 3)
    if len(corners) == 0:
        raise ValueError("no triangles given: nothing is closest to a point")
    if not (np.isfinite(points).all() and np.isfinite(corners).all()):
        raise ValueError("points and triangles should be finite; drop NaN points while sensing")
    return Closest(*_search(points, corners))


@njit(cache=True, nogil=True)
def _search(points: Floats, corners: Floats) -> tuple[Floats, NDArray[np.int64], Floats]:
    count = len(points)
    distance, index, weights = np.empty(count), np.empty(count, np.int64), np.empty((count, 3))
    centroid, radius, normal = _discs(corners)
    cells = sorted_into_cells(centroid, 1.5 * spacing_m(centroid))
    radius, normal = radius[cells.order], normal[cells.order]
    widest, rings, ranges = radius.max(), last_ring(cells), range_buffer(cells)
    nearest = 0
    for i in range(count):
        p = (points[i, 0], points[i, 1], points[i, 2])
        # Points follow each other along the rows of a picture: what was nearest is near again.
        square, weight = _distance(p, corners, nearest)
        best = np.sqrt(square)
        cube, inside, outside = home(cells, p)
        for ring in range(rings):
            if ring > 0 and ring_m(cells, ring, inside, outside) > best + widest:
                break
            for r in range(ring_ranges(cells, cube, ring, ranges)):
                for at in range(ranges[r, 0], ranges[r, 1]):
                    x = p[0] - cells.points_m[at, 0]
                    y = p[1] - cells.points_m[at, 1]
                    z = p[2] - cells.points_m[at, 2]
                    away = x * x + y * y + z * z
                    if away > (best + radius[at]) ** 2:
                        continue
                    height = x * normal[at, 0] + y * normal[at, 1] + z * normal[at, 2]
                    # From the triangle's disc to the point: as far up as sideways beyond the rim.
                    beside = max(np.sqrt(max(away - height * height, 0.0)) - radius[at], 0.0)
                    if height * height + beside * beside > square * _ROUNDING:
                        continue
                    t = cells.order[at]
                    other, its_weight = _distance(p, corners, t)
                    if other < square or (other == square and t < nearest):
                        square, weight, nearest = other, its_weight, t
                        best = np.sqrt(square)
        distance[i], index[i] = best, nearest
        weights[i, 0], weights[i, 1], weights[i, 2] = weight
    return distance, index, weights


@njit(cache=True, nogil=True)
def _discs(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Centroids (m, 3) of triangles, radii (m,) that reach all corners, and unit normals (m, 3).

    A triangle without area has no normal, and gets zeros: its disc is then a ball.
    """
    count = len(corners)
    centroid, radius, normal = np.empty((count, 3)), np.empty(count), np.empty((count, 3))
    for t in range(count):
        for k in range(3):
            centroid[t, k] = (corners[t, 0, k] + corners[t, 1, k] + corners[t, 2, k]) / 3
            m, n = (k + 1) % 3, (k + 2) % 3
            normal[t, k] = (corners[t, 1, m] - corners[t, 0, m]) * (
                corners[t, 2, n] - corners[t, 0, n]
            ) - (corners[t, 1, n] - corners[t, 0, n]) * (corners[t, 2, m] - corners[t, 0, m])
        farthest = 0.0
        for corner in range(3):
            square = 0.0
            for k in range(3):
                square += (corners[t, corner, k] - centroid[t, k]) ** 2
            farthest = max(farthest, square)
        radius[t] = np.sqrt(farthest)
        length = np.sqrt(normal[t, 0] ** 2 + normal[t, 1] ** 2 + normal[t, 2] ** 2)
        for k in range(3):
            normal[t, k] = normal[t, k] / length if length > _FLAT * farthest else 0.0
    return centroid, radius, normal


@njit(cache=True, nogil=True)
def _distance(
    p: tuple[float, float, float], corners: Floats, t: int
) -> tuple[float, tuple[float, float, float]]:
    """Square of the distance to triangle ``t``, and the weights of its closest point."""
    u, v, w = _weights(p, corners, t)
    square = 0.0
    for k in range(3):
        square += (u * corners[t, 0, k] + v * corners[t, 1, k] + w * corners[t, 2, k] - p[k]) ** 2
    return square, (u, v, w)


@njit(cache=True, nogil=True)
def _weights(p: tuple[float, float, float], corners: Floats, t: int) -> tuple[float, float, float]:
    """Barycentric coordinates of the point of triangle ``t`` closest to ``p``.

    Ericson, Real-Time Collision Detection (2005), section 5.1.5: the Voronoi regions of the
    corners, the edges and the face, in turn.
    """
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        a, b, c = corners[t, 0, k], corners[t, 1, k], corners[t, 2, k]
        ab, ac = b - a, c - a
        d1 += ab * (p[k] - a)
        d2 += ac * (p[k] - a)
        d3 += ab * (p[k] - b)
        d4 += ac * (p[k] - b)
        d5 += ab * (p[k] - c)
        d6 += ac * (p[k] - c)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    total = va + vb + vc
    return va / total, vb / total, vc / total
