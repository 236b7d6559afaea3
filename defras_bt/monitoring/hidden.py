"""Which places on a surface the surface itself hides from the camera, in compiled loops.

The picture is divided into tiles, and each tile lists the triangles that may cover a part of it.
A place is compared with those of its own tile, exactly: with the pyramid from the eye over the
triangle, and with the plane of the triangle.

Only triangles whose outer side faces the eye are asked whether they hide something. That is
enough: a ray from outside enters tissue before it leaves it. It does even where tissue is folded
into itself, since no deformation of tissue turns its inside out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

# Of the distance to the eye. A place this little behind a triangle is not hidden: where the
# surface touches itself, rounding should not decide.
_TOLERANCE = 1e-5
_BEHIND_M = 1e-9
# Sides of tiles to sides of triangles: narrower tiles list less, but each triangle more often.
_TILE = 0.6


@jit
def facing_triangles(in_camera_m: Floats, triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Indices of the triangles whose outer side faces the eye, the origin of ``in_camera_m``."""
    chosen, count = np.empty(len(triangles), np.int64), 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if _determinant(in_camera_m, a, b, c) < 0.0:
            chosen[count] = t
            count += 1
    return chosen[:count].copy()


@jit
def seen_places(
    in_camera_m: Floats,
    triangles: NDArray[np.int64],
    places: Floats,
    intrinsics: Floats,
    size_px: Floats,
) -> NDArray[np.bool_]:
    """Which places (m, s) of triangles (m, 3) that face the eye are in the picture and not hidden.

    ``in_camera_m`` (n, 3) are vertices in camera coordinates, ``places`` (s, 3) are barycentric,
    ``intrinsics`` (3, 3) lead to pixels, and the picture is ``size_px`` (2,) of them.
    """
    seen = np.zeros((len(triangles), len(places)), np.bool_)
    if len(triangles) == 0:
        return seen
    boxes = _boxes_px(in_camera_m, triangles, intrinsics, size_px)
    left, right = boxes[:, 0].min(), boxes[:, 1].max()
    top, bottom = boxes[:, 2].min(), boxes[:, 3].max()
    area_px = max(right - left, 1.0) * max(bottom - top, 1.0)
    per_px = np.sqrt(len(triangles) / area_px) / _TILE
    columns, rows = int((right - left) * per_px) + 1, int((bottom - top) * per_px) + 1
    first, listed = _tiles(boxes, left, top, per_px, columns, rows)
    pyramids = _pyramids(in_camera_m, triangles)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for s in range(len(places)):
            u, v, w = places[s, 0], places[s, 1], places[s, 2]
            x = u * in_camera_m[a, 0] + v * in_camera_m[b, 0] + w * in_camera_m[c, 0]
            y = u * in_camera_m[a, 1] + v * in_camera_m[b, 1] + w * in_camera_m[c, 1]
            z = u * in_camera_m[a, 2] + v * in_camera_m[b, 2] + w * in_camera_m[c, 2]
            if z <= _BEHIND_M:
                continue
            inverse = 1.0 / z
            across = intrinsics[0, 0] * x * inverse + intrinsics[0, 2]
            down = intrinsics[1, 1] * y * inverse + intrinsics[1, 2]
            if not (-0.5 <= across <= size_px[0] - 0.5 and -0.5 <= down <= size_px[1] - 0.5):
                continue
            column = min(max(int((across - left) * per_px), 0), columns - 1)
            row = min(max(int((down - top) * per_px), 0), rows - 1)
            at = column * rows + row
            seen[t, s] = not _hidden(x, y, z, t, pyramids, listed, first[at], first[at + 1])
    return seen


@jit
def _hidden(
    x: float,
    y: float,
    z: float,
    own: int,
    pyramids: Floats,
    listed: NDArray[np.int64],
    start: int,
    end: int,
) -> bool:
    """Whether one of ``listed[start:end]`` but ``own`` is in front of a place."""
    for i in range(start, end):
        t = listed[i]
        ab = x * pyramids[t, 0] + y * pyramids[t, 1] + z * pyramids[t, 2]
        if ab > 0.0:
            continue
        bc = x * pyramids[t, 3] + y * pyramids[t, 4] + z * pyramids[t, 5]
        if bc > 0.0:
            continue
        ca = x * pyramids[t, 6] + y * pyramids[t, 7] + z * pyramids[t, 8]
        # The ray meets the triangle's plane at determinant / (ab + bc + ca) times the place.
        if ca <= 0.0 and pyramids[t, 9] > (1.0 - _TOLERANCE) * (ab + bc + ca) and t != own:
            return True
    return False


@jit
def _pyramids(in_camera_m: Floats, triangles: NDArray[np.int64]) -> Floats:
    """For each triangle a, b, c (m, 10): the normals a x b, b x c, c x a, and its determinant.

    They point outwards of the pyramid from the eye if the triangle faces it.
    """
    pyramids = np.empty((len(triangles), 10))
    for t in range(len(triangles)):
        for side in range(3):
            p, q = triangles[t, side], triangles[t, (side + 1) % 3]
            for k in range(3):
                m, n = (k + 1) % 3, (k + 2) % 3
                pyramids[t, 3 * side + k] = (
                    in_camera_m[p, m] * in_camera_m[q, n] - in_camera_m[p, n] * in_camera_m[q, m]
                )
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        pyramids[t, 9] = _determinant(in_camera_m, a, b, c)
    return pyramids


@jit
def _determinant(points: Floats, a: int, b: int, c: int) -> float:
    """Of the columns a, b, c: negative if the triangle's outer side faces the origin."""
    ux, uy, uz = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    vx, vy, vz = (
        points[c, 0] - points[a, 0],
        points[c, 1] - points[a, 1],
        points[c, 2] - points[a, 2],
    )
    return (
        points[a, 0] * (uy * vz - uz * vy)
        + points[a, 1] * (uz * vx - ux * vz)
        + points[a, 2] * (ux * vy - uy * vx)
    )


@jit
def _boxes_px(
    in_camera_m: Floats, triangles: NDArray[np.int64], intrinsics: Floats, size_px: Floats
) -> Floats:
    """Box (m, 4) around each triangle's picture: left, right, top, bottom; clipped to the picture.

    A triangle that reaches behind the eye may cover all of the picture.
    """
    pixels = np.empty((len(in_camera_m), 2))
    for i in range(len(in_camera_m)):
        z = max(in_camera_m[i, 2], _BEHIND_M)
        for k in range(2):
            pixels[i, k] = intrinsics[k, k] * in_camera_m[i, k] / z + intrinsics[k, 2]
    boxes = np.empty((len(triangles), 4))
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        behind = min(in_camera_m[a, 2], in_camera_m[b, 2], in_camera_m[c, 2]) <= _BEHIND_M
        for k in range(2):
            end = size_px[k] - 0.5
            low = min(pixels[a, k], pixels[b, k], pixels[c, k])
            high = max(pixels[a, k], pixels[b, k], pixels[c, k])
            boxes[t, 2 * k] = -0.5 if behind else min(max(low, -0.5), end)
            boxes[t, 2 * k + 1] = end if behind else min(max(high, -0.5), end)
    return boxes


@jit
def _tiles(
    boxes: Floats, left: float, top: float, per_px: float, columns: int, rows: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """What tile i lists, counted by columns: triangles ``listed[first[i] : first[i + 1]]``."""
    spans = np.empty((len(boxes), 4), np.int64)
    first = np.zeros(columns * rows + 1, np.int64)
    for t in range(len(boxes)):
        for k in range(2):
            spans[t, k] = int((boxes[t, k] - left) * per_px)
            spans[t, 2 + k] = int((boxes[t, 2 + k] - top) * per_px)
        for column in range(spans[t, 0], spans[t, 1] + 1):
            for row in range(spans[t, 2], spans[t, 3] + 1):
                first[column * rows + row + 1] += 1
    for i in range(1, len(first)):
        first[i] += first[i - 1]
    listed, place = np.empty(first[-1], np.int64), first[:-1].copy()
    for t in range(len(boxes)):
        for column in range(spans[t, 0], spans[t, 1] + 1):
            for row in range(spans[t, 2], spans[t, 3] + 1):
                listed[place[column * rows + row]] = t
                place[column * rows + row] += 1
    return first, listed
