"""Triangles by the tiles of a picture that they may cover a part of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

BEHIND_M = 1e-9
"""What is nearer to the plane of the eye than this, or behind it, is in no picture."""
Point = tuple[float, float, float]


class TileGrid(NamedTuple):
    """Tiles by columns. ``left_px`` and ``top_px``: corner of the first; ``per_px``: one over the
    side of each."""

    left_px: float
    top_px: float
    per_px: float
    columns: int
    rows: int


class PictureTiles(NamedTuple):
    """Tile i of ``grid`` lists the triangles ``listed[first[i] : first[i + 1]]``."""

    first: NDArray[np.int64]
    listed: NDArray[np.int64]
    grid: TileGrid


@jit
def picture_tiles(
    in_camera_m: Floats,
    triangles: NDArray[np.int64],
    intrinsics: Floats,
    size_px: Floats,
    side: float,
) -> PictureTiles:
    """List ``triangles`` (m, 3) of vertices (n, 3) in camera coordinates.

    ``intrinsics`` (3, 3) lead to pixels, the picture is ``size_px`` (2,) of them. ``side`` is that
    of a tile, to the side of a mean triangle's picture.
    """
    if len(triangles) == 0:
        nothing = TileGrid(0.0, 0.0, 1.0, 1, 1)
        return PictureTiles(np.zeros(2, np.int64), np.empty(0, np.int64), nothing)
    boxes = _boxes_px(in_camera_m, triangles, intrinsics, size_px)
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for t in range(len(boxes)):
        left, right = min(left, boxes[t, 0]), max(right, boxes[t, 1])
        top, bottom = min(top, boxes[t, 2]), max(bottom, boxes[t, 3])
    area_px = max(right - left, 1.0) * max(bottom - top, 1.0)
    per_px = np.sqrt(len(triangles) / area_px) / side
    columns, rows = int((right - left) * per_px) + 1, int((bottom - top) * per_px) + 1
    first, listed = _listed(boxes, left, top, per_px, columns, rows)
    return PictureTiles(first, listed, TileGrid(left, top, per_px, columns, rows))


@jit
def tile_at(grid: TileGrid, at: Point, intrinsics: Floats, size_px: Floats) -> int:
    """The tile that a place in camera coordinates appears in; -1 if it is not in the picture."""
    x, y, z = at
    if z <= BEHIND_M:
        return -1
    inverse = 1.0 / z
    across = intrinsics[0, 0] * x * inverse + intrinsics[0, 2]
    down = intrinsics[1, 1] * y * inverse + intrinsics[1, 2]
    if not (-0.5 <= across <= size_px[0] - 0.5 and -0.5 <= down <= size_px[1] - 0.5):
        return -1
    column = min(max(int((across - grid.left_px) * grid.per_px), 0), grid.columns - 1)
    row = min(max(int((down - grid.top_px) * grid.per_px), 0), grid.rows - 1)
    return column * grid.rows + row


@jit
def _boxes_px(
    in_camera_m: Floats, triangles: NDArray[np.int64], intrinsics: Floats, size_px: Floats
) -> Floats:
    """Box (m, 4) around each triangle's picture: left, right, top, bottom; clipped to the picture.

    A triangle that reaches behind the eye may cover all of the picture.
    """
    pixels = np.empty((len(in_camera_m), 2))
    for i in range(len(in_camera_m)):
        z = max(in_camera_m[i, 2], BEHIND_M)
        for k in range(2):
            pixels[i, k] = intrinsics[k, k] * in_camera_m[i, k] / z + intrinsics[k, 2]
    boxes = np.empty((len(triangles), 4))
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        behind = min(in_camera_m[a, 2], in_camera_m[b, 2], in_camera_m[c, 2]) <= BEHIND_M
        for k in range(2):
            end = size_px[k] - 0.5
            low = min(pixels[a, k], pixels[b, k], pixels[c, k])
            high = max(pixels[a, k], pixels[b, k], pixels[c, k])
            boxes[t, 2 * k] = -0.5 if behind else min(max(low, -0.5), end)
            boxes[t, 2 * k + 1] = end if behind else min(max(high, -0.5), end)
    return boxes


@jit
def _listed(
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
