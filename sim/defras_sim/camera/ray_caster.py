"""Rays against the tissue's surface, by Intel Embree.

embreex is called directly: trimesh's wrapper around it hashes and rescales the mesh, which costs
more than building the search tree of a surface that is new in every frame.
"""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.surface import Surface

# Embree computes in single precision: 0.3 m away, a hit is known to about 0.1 micrometres.
_TOLERANCE = 1e-5


class RayCaster:
    """A search tree over one surface, built once and asked many times."""

    def __init__(self, surface: Surface) -> None:
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(
            self._scene, surface.vertices_m.astype(np.float32), surface.triangles.astype(np.int32)
        )

    def hits(self, origin_m: Floats, directions: Floats) -> Floats:
        """Multiples (n,) of ``directions`` (n, 3) at the first hit from one origin; inf: none."""
        found = self._cast(origin_m, directions)
        return np.where(found < 1e30, found, np.inf)

    def sees(self, origin_m: Floats, points_m: Floats) -> NDArray[np.bool_]:
        """Which ``points_m`` (n, 3) the surface does not hide from ``origin_m`` (3,).

        Points of the surface itself count as seen where they lie on its visible side.
        """
        return self._cast(origin_m, points_m - origin_m) > 1.0 - _TOLERANCE

    def _cast(self, origin_m: Floats, directions: Floats) -> Floats:
        origins = np.tile(np.asarray(origin_m, np.float32), (len(directions), 1))
        found = self._scene.run(origins, directions.astype(np.float32), query="DISTANCE")
        return np.asarray(found, float)
