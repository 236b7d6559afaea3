"""Which places on a surface the surface itself hides from the camera, in compiled loops.

The picture is divided into tiles, and each tile lists the triangles that may cover a part of it.
A place is compared with those of its own tile, exactly: with the pyramid from the eye over the
triangle, and with the plane of the triangle.

Only triangles whose outer side faces the eye are asked whether they hide something. That is
enough: a ray from outside enters tissue before it leaves it. It does even where tissue is folded
into itself, since no deformation of tissue turns its inside out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.picture_tiles import (
    PictureTiles,
    Point,
    picture_tiles,
    tile_at,
)
from defras_sim.geometry import Floats
from defras_sim.tissue.matrices import jit

# Of the distance to the eye. A place this little behind a triangle is not hidden: where the
# surface touches itself, rounding should not decide.
_TOLERANCE = 1e-5
# Sides of tiles to sides of triangles, measured: narrower tiles list less, but each triangle more
# often.
_TILE = 0.8


class Optics(NamedTuple):
    """A camera: ``eye_m`` (3,) and ``rotation`` (3, 3) are tissue_from_camera.

    ``intrinsics`` (3, 3) lead to pixels, and the picture is ``size_px`` (2,) of them.
    """

    eye_m: Floats
    rotation: Floats
    intrinsics: Floats
    size_px: Floats


class Sight(NamedTuple):
    """What :func:`look` found of a surface, to be asked which of its places are seen.

    ``facing`` (m,) are the indices of the triangles whose outer side faces the eye, ``triangles``
    (m, 3) their vertices, which ``in_camera_m`` (n, 3) has in camera coordinates. ``pyramids``
    (m, 10) are from the eye over them.
    """

    in_camera_m: Floats
    facing: NDArray[np.int64]
    triangles: NDArray[np.int64]
    tiles: PictureTiles
    pyramids: Floats


@jit
def look(vertices_m: Floats, triangles: NDArray[np.int64], optics: Optics) -> Sight:
    """Look at a surface of vertices (n, 3) and ``triangles`` (k, 3)."""
    in_camera = np.empty(vertices_m.shape)
    eye, turn = optics.eye_m, optics.rotation
    for i in range(len(vertices_m)):
        x, y, z = vertices_m[i, 0] - eye[0], vertices_m[i, 1] - eye[1], vertices_m[i, 2] - eye[2]
        for k in range(3):
            in_camera[i, k] = x * turn[0, k] + y * turn[1, k] + z * turn[2, k]
    facing, corners, count = np.empty(len(triangles), np.int64), np.empty_like(triangles), 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if _determinant(in_camera, a, b, c) < 0.0:
            facing[count], corners[count] = t, triangles[t]
            count += 1
    seen = corners[:count].copy()
    tiles = picture_tiles(in_camera, seen, optics.intrinsics, optics.size_px, _TILE)
    return Sight(in_camera, facing[:count].copy(), seen, tiles, _pyramids(in_camera, seen))


@jit
def seen_places(sight: Sight, places: Floats, optics: Optics) -> NDArray[np.bool_]:
    """Which ``places`` (s, 3) of the m triangles are in the picture and not hidden: (m, s).

    Places are barycentric, the same on each triangle.
    """
    in_camera, triangles, pyramids = sight.in_camera_m, sight.triangles, sight.pyramids
    first, listed, grid = sight.tiles.first, sight.tiles.listed, sight.tiles.grid
    intrinsics, size_px = optics.intrinsics, optics.size_px
    seen = np.zeros((len(triangles), len(places)), np.bool_)
    for t in range(len(triangles)):
        for s in range(len(places)):
            at = _place(in_camera, triangles, t, places, s)
            tile = tile_at(grid, at, intrinsics, size_px)
            seen[t, s] = tile >= 0 and not _hidden(
                at, t, pyramids, listed, first[tile], first[tile + 1]
            )
    return seen


@jit
def touched_vertices(sight: Sight, places: Floats, optics: Optics) -> NDArray[np.bool_]:
    """Vertices (n,) of the triangles of which :func:`seen_places` would find any place seen.

    It takes a fifth of the time: most places need not be looked at.
    """
    in_camera, triangles, pyramids = sight.in_camera_m, sight.triangles, sight.pyramids
    first, listed, grid = sight.tiles.first, sight.tiles.listed, sight.tiles.grid
    intrinsics, size_px = optics.intrinsics, optics.size_px
    touched = np.zeros(len(in_camera), np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if touched[a] and touched[b] and touched[c]:
            continue
        for s in range(len(places)):
            at = _place(in_camera, triangles, t, places, s)
            tile = tile_at(grid, at, intrinsics, size_px)
            if tile >= 0 and not _hidden(at, t, pyramids, listed, first[tile], first[tile + 1]):
                touched[a] = touched[b] = touched[c] = True
                break
    return touched


@jit
def _place(
    in_camera_m: Floats, triangles: NDArray[np.int64], t: int, places: Floats, s: int
) -> Point:
    """Where the place number ``s`` on triangle ``t`` is."""
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    u, v, w = places[s, 0], places[s, 1], places[s, 2]
    return (
        u * in_camera_m[a, 0] + v * in_camera_m[b, 0] + w * in_camera_m[c, 0],
        u * in_camera_m[a, 1] + v * in_camera_m[b, 1] + w * in_camera_m[c, 1],
        u * in_camera_m[a, 2] + v * in_camera_m[b, 2] + w * in_camera_m[c, 2],
    )


@jit
def _hidden(
    at: Point,
    own: int,
    pyramids: Floats,
    listed: NDArray[np.int64],
    start: int,
    end: int,
) -> bool:
    """Whether one of ``listed[start:end]`` but ``own`` is in front of a place."""
    x, y, z = at
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
