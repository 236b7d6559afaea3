"""Which triangles of the tissue's surface make its upper and its lower face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_sim.anatomy.curved_face import CurvedFace
from defras_sim.geometry import Floats

Triangles = NDArray[np.int64]

# Cosine to the vertical; steeper is a side, neither the upper nor the lower face.
STEEPEST = 0.3


def sides(vertices_m: Floats, triangles: Triangles) -> NDArray[np.int64]:
    """1 for each triangle (m,) of the upper face, -1 for the lower, 0 for neither.

    The upper face faces up, not too steeply, with no tissue above it; the lower one likewise.
    """
    slope = slopes(vertices_m, triangles)
    centre = vertices_m[triangles].mean(axis=1)
    result = np.zeros(len(triangles), dtype=np.int64)
    tolerance_m = 1e-6 + 1e-6 * float(np.ptp(vertices_m, axis=0).max())
    for sign in (1, -1):
        facing = np.flatnonzero(sign * slope > STEEPEST)
        if not len(facing):
            continue
        face = CurvedFace(vertices_m, triangles[facing], sign)
        outermost = face.at(centre[facing][:, :2])[:, 2]
        free = np.abs(outermost - centre[facing, 2]) <= tolerance_m
        result[facing[free]] = sign
    return result


def slopes(vertices_m: Floats, triangles: Triangles) -> Floats:
    """Cosine (m,) of each triangle's normal to the vertical; negative where it faces down."""
    a, b, c = np.moveaxis(vertices_m[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    return np.asarray(normal[:, 2] / np.maximum(np.linalg.norm(normal, axis=1), 1e-300))
