"""Small meshes and outlines for pictures of the scene, all in the tissue frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Triangles = NDArray[np.int64]


def vertex_normals(vertices_m: Floats, triangles: Triangles) -> Floats:
    """Unit normals (n, 3): the area-weighted mean over the triangles around each vertex."""
    corners = vertices_m[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    count, at = len(vertices_m), triangles.ravel()
    total = np.stack(
        [np.bincount(at, np.repeat(face[:, i], 3), minlength=count) for i in range(3)], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.tile([0.0, 0.0, 1.0], (count, 1)), where=length > 0)


def circle(center_m: Floats, radius_m: float, segments: int = 48) -> Floats:
    """Closed outline (segments + 1, 3) in a plane of constant z."""
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    return np.asarray(center_m) + radius_m * ring


def disc(center_m: Floats, radius_m: float, segments: int = 48) -> tuple[Floats, Triangles]:
    """Flat disc, facing up."""
    rim = circle(center_m, radius_m, segments)[:-1]
    ahead = np.roll(np.arange(segments), -1)
    fan = np.stack([np.full(segments, segments), np.arange(segments), ahead], axis=1)
    return np.concatenate([rim, np.asarray(center_m)[None]]), fan


def rectangle(half_x_m: float, half_y_m: float, z_m: float) -> tuple[Floats, Triangles]:
    """Flat rectangle about the z axis, facing up."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    vertices = np.array([(half_x_m * x, half_y_m * y, z_m) for x, y in corners])
    return vertices, np.array([(0, 1, 2), (0, 2, 3)])
