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

from defras_bt.monitoring.hidden import Optics, look, seen_places, touched_vertices
from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.geometry import Floats
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

    def prepared(self) -> bool:
        """Make :attr:`samples_m` now; False if that was still to be done."""
        if "samples_m" in self.__dict__:
            return True
        self.__dict__["samples_m"] = self.sample()
        return False


def seen_surface(surface: Surface, camera: Camera) -> SeenSurface:
    """What ``camera`` sees of ``surface``; everything is empty where it sees nothing."""
    optics = _optics(camera)
    vertices = np.ascontiguousarray(surface.vertices_m)
    triangles = np.ascontiguousarray(surface.triangles)
    chosen, corners = _chosen(vertices, triangles, _PLACES, optics)
    return SeenSurface(chosen, corners, lambda: _samples(vertices, triangles, _PLACES, optics))


@lru_cache(maxsize=8)
def _optics(camera: Camera) -> Optics:
    pose, size_px = tissue_from_camera(camera), [camera.width_px, camera.height_px]
    eye_m, turn = pose.position_m, np.ascontiguousarray(pose.rotation)
    return Optics(eye_m, turn, intrinsics(camera), np.array(size_px, float))


@jit
def _chosen(
    vertices_m: Floats, surface: NDArray[np.int64], places: Floats, optics: Optics
) -> tuple[NDArray[np.int64], Floats]:
    """Triangles that face the eye and have a vertex of a seen one, and their corners.

    All in one compiled call: to hand what :func:`look` found to and fro takes as long as to look.
    """
    sight = look(vertices_m, surface, optics)
    touched = touched_vertices(sight, places, optics)
    facing, triangles = sight.facing, sight.triangles
    chosen, corners, found = np.empty_like(facing), np.empty((len(facing), 3, 3)), 0
    for t in range(len(facing)):
        if touched[triangles[t, 0]] or touched[triangles[t, 1]] or touched[triangles[t, 2]]:
            chosen[found] = facing[t]
            for k in range(3):
                for j in range(3):
                    corners[found, k, j] = vertices_m[triangles[t, k], j]
            found += 1
    return chosen[:found].copy(), corners[:found].copy()


@jit
def _samples(
    vertices_m: Floats, surface: NDArray[np.int64], places: Floats, optics: Optics
) -> Floats:
    """Where those of ``places`` (s, 3) on the triangles that face the eye are that are seen."""
    sight = look(vertices_m, surface, optics)
    seen, triangles = seen_places(sight, places, optics), sight.triangles
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
