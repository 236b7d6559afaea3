"""How far a point is from a triangle: a bound in a few operations, and the exact distance.

Each triangle is described by four planes: its own, and one upright on each edge, facing inwards.
Over the face, the distance to the first is the distance to the triangle; beside it, the way beyond
the farthest edge and the height together are no more than the distance.
"""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

# Twice a triangle's area over the square of its longest edge: below this, planes say nothing.
_FLAT = 1e-3

Point = tuple[float, float, float]


@jit
def planes_of(corners_m: Floats) -> Floats:
    """Planes (m, 16) of triangles (m, 3, 3).

    As a matrix (4, 4) with a column for each plane, face first, then edges ab, ca, bc: unit normal,
    then offset. A triangle (nearly) without area has no planes: its bound is 0 beside the face.
    """
    planes = np.zeros((len(corners_m), 16))
    for t in range(len(corners_m)):
        a, b, c = corners_m[t, 0], corners_m[t, 1], corners_m[t, 2]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = a[0] - c[0], a[1] - c[1], a[2] - c[2]
        wx, wy, wz = c[0] - b[0], c[1] - b[1], c[2] - b[2]
        nx, ny, nz = vy * uz - vz * uy, vz * ux - vx * uz, vx * uy - vy * ux
        ab, ca, bc = (
            ux * ux + uy * uy + uz * uz,
            vx * vx + vy * vy + vz * vz,
            wx * wx + wy * wy + wz * wz,
        )
        twice_area = np.sqrt(nx * nx + ny * ny + nz * nz)
        if twice_area <= _FLAT * max(ab, ca, bc):
            planes[t, 13] = -np.inf
            continue
        nx, ny, nz = nx / twice_area, ny / twice_area, nz / twice_area
        _set_plane(planes, t, 0, (nx, ny, nz), a)
        ab, ca, bc = 1.0 / np.sqrt(ab), 1.0 / np.sqrt(ca), 1.0 / np.sqrt(bc)
        _set_plane(planes, t, 1, _inwards(nx, ny, nz, ux, uy, uz, ab), a)
        _set_plane(planes, t, 2, _inwards(nx, ny, nz, vx, vy, vz, ca), c)
        _set_plane(planes, t, 3, _inwards(nx, ny, nz, wx, wy, wz, bc), b)
    return planes


@jit
def _inwards(nx: float, ny: float, nz: float, x: float, y: float, z: float, scale: float) -> Point:
    return (ny * z - nz * y) * scale, (nz * x - nx * z) * scale, (nx * y - ny * x) * scale


@jit
def _set_plane(planes: Floats, t: int, column: int, normal: Point, through_m: Floats) -> None:
    for k in range(3):
        planes[t, 4 * k + column] = normal[k]
    planes[t, 12 + column] = -(
        normal[0] * through_m[0] + normal[1] * through_m[1] + normal[2] * through_m[2]
    )


@jit
def bound(p: Point, planes: Floats, t: int) -> tuple[float, bool]:
    """Square of a distance that triangle ``t`` is no nearer than, and whether it is just as near.

    It is just as near where the point is above or below the face.
    """
    height = p[0] * planes[t, 0] + p[1] * planes[t, 4] + p[2] * planes[t, 8] + planes[t, 12]
    ab = p[0] * planes[t, 1] + p[1] * planes[t, 5] + p[2] * planes[t, 9] + planes[t, 13]
    ca = p[0] * planes[t, 2] + p[1] * planes[t, 6] + p[2] * planes[t, 10] + planes[t, 14]
    bc = p[0] * planes[t, 3] + p[1] * planes[t, 7] + p[2] * planes[t, 11] + planes[t, 15]
    beside = min(ab, ca, bc)
    if beside >= 0.0:
        return height * height, True
    if beside == -np.inf:
        return 0.0, False
    return height * height + beside * beside, False


@jit
def square_to(p: Point, corners_m: Floats, t: int) -> float:
    """Square of the distance to triangle ``t``."""
    u, v, w = weights_of(p, corners_m, t)
    square = 0.0
    for k in range(3):
        on = u * corners_m[t, 0, k] + v * corners_m[t, 1, k] + w * corners_m[t, 2, k]
        square += (on - p[k]) ** 2
    return square


@jit
def weights_of(p: Point, corners_m: Floats, t: int) -> Point:
    """Barycentric coordinates of the point of triangle ``t`` closest to ``p``.

    Ericson, Real-Time Collision Detection (2005), section 5.1.5: the Voronoi regions of the
    corners, the edges and the face, in turn.
    """
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        a, b, c = corners_m[t, 0, k], corners_m[t, 1, k], corners_m[t, 2, k]
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
