"""The part of the simulated surface that the depth camera could see.

Observed points may be compared with this part only. Compared with the whole surface, a slab that
is off by its own thickness would match its lower face perfectly, and bed-side tissue seen where
the twin has a flap in front of it would match tissue that the twin itself hides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.hidden import facing_triangles, seen_places, touched_vertices
from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera
from defras_sim.surface import Surface
from defras_sim.tissue.matrices import jit

# Barycentric places at which a triangle is tested: in the middle and near its corners. They are
# also the simulated cloud, about 3 mm apart on a mesh of the default density.
_PLACES = np.array([[1 / 3, 1 / 3, 1 / 3], [0.7, 0.15, 0.15], [0.15, 0.7, 0.15], [0.15, 0.15, 0.7]])


@dataclass(frozen=True)
class SeenSurface:
    """``triangles`` (k,) indexes ``surface.triangles``; ``corners_m`` (k, 3, 3) are theirs.

    Triangles next to a seen one count as seen if they face the camera, so that an edge of the
    picture or of an occlusion that is off by a fraction of a triangle is no discrepancy. ``sample``
    makes :attr:`samples_m`, when somebody wants it.
    """

    triangles: NDArray[np.int64]
    corners_m: Floats
    sample: Callable[[], Floats] = field(repr=False, compare=False)

    @cached_property
    def samples_m(self) -> Floats:
        """The cloud (s, 3) that a noiseless camera would deliver."""
        return self.sample()


def seen_surface(surface: Surface, camera: Camera) -> SeenSurface:
    """What ``camera`` sees of ``surface``; everything is empty where it sees nothing."""
    pose, intrinsic, size_px = _optics(camera)
    vertices = np.ascontiguousarray(surface.vertices_m)
    triangles = np.ascontiguousarray(surface.triangles)
    in_camera = (vertices - pose.position_m) @ pose.rotation
    facing = facing_triangles(in_camera, triangles)
    looked_at = in_camera, triangles[facing], _PLACES, intrinsic, size_px

    def sample() -> Floats:
        return _placed(vertices, triangles[facing], seen_places(*looked_at), _PLACES)

    chosen, corners = _chosen(vertices, triangles, facing, touched_vertices(*looked_at))
    return SeenSurface(chosen, corners, sample)


@lru_cache(maxsize=8)
def _optics(camera: Camera) -> tuple[Pose, Floats, Floats]:
    """tissue_from_camera, intrinsics (3, 3) and size in pixels (2,)."""
    size_px = np.array([camera.width_px, camera.height_px], float)
    return tissue_from_camera(camera), intrinsics(camera), size_px


@jit
def _chosen(
    vertices_m: Floats,
    triangles: NDArray[np.int64],
    facing: NDArray[np.int64],
    touched: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], Floats]:
    """Triangles ``facing`` (m,) with a vertex that is ``touched`` (n,), and their corners."""
    chosen, corners, found = np.empty_like(facing), np.empty((len(facing), 3, 3)), 0
    for t in facing:
        if touched[triangles[t, 0]] or touched[triangles[t, 1]] or touched[triangles[t, 2]]:
            chosen[found] = t
            for k in range(3):
                for j in range(3):
                    corners[found, k, j] = vertices_m[triangles[t, k], j]
            found += 1
    return chosen[:found].copy(), corners[:found].copy()


@jit
def _placed(
    vertices_m: Floats, triangles: NDArray[np.int64], seen: NDArray[np.bool_], places: Floats
) -> Floats:
    """Where those of ``places`` (s, 3) are that are ``seen`` (m, s) of ``triangles`` (m, 3)."""
    samples, count = np.empty((seen.size, 3)), 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for s in range(len(places)):
            if seen[t, s]:
                for k in range(3):
                    samples[count, k] = (
                        places[s, 0] * vertices_m[a, k]
                        + places[s, 1] * vertices_m[b, k]
                        + places[s, 2] * vertices_m[c, k]
                    )
                count += 1
    return samples[:count].copy()
