"""The part of the simulated surface that the depth camera could see.

Observed points may be compared with this part only. Compared with the whole surface, a slab that
is off by its own thickness would match its lower face perfectly, and bed-side tissue seen where
the twin has a flap in front of it would match tissue that the twin itself hides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.camera.pinhole import in_picture
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats
from defras_sim.scene import Camera
from defras_sim.surface import Surface

# Barycentric places at which a triangle is tested: near its corners and in the middle. They are
# also the simulated cloud, about 3 mm apart on a mesh of the default density.
_PLACES = np.array([[0.7, 0.15, 0.15], [0.15, 0.7, 0.15], [0.15, 0.15, 0.7], [1 / 3, 1 / 3, 1 / 3]])


@dataclass(frozen=True)
class SeenSurface:
    """``triangles`` (k,) indexes ``surface.triangles``; ``corners_m`` (k, 3, 3) are theirs.

    ``samples_m`` (s, 3) is the cloud a noiseless camera would deliver. Triangles next to a seen
    one count as seen if they face the camera, so that an edge of the picture or of an occlusion
    that is off by a fraction of a triangle is no discrepancy.
    """

    triangles: NDArray[np.int64]
    corners_m: Floats
    samples_m: Floats


def seen_surface(surface: Surface, camera: Camera) -> SeenSurface:
    """What ``camera`` sees of ``surface``; everything is empty where it sees nothing."""
    corners = surface.vertices_m[surface.triangles]
    eye = np.array(camera.position_m)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = np.flatnonzero(np.einsum("ij,ij->i", normal, eye - corners.mean(axis=1)) > 0.0)
    samples = np.einsum("sk,tkd->tsd", _PLACES, corners[facing]).reshape(-1, 3)
    seen = RayCaster(surface).sees(eye, samples) & in_picture(camera, samples)
    seen_triangle = seen.reshape(-1, len(_PLACES)).any(axis=1)
    touched = np.zeros(len(surface.vertices_m), bool)
    touched[surface.triangles[facing[seen_triangle]]] = True
    chosen = facing[touched[surface.triangles[facing]].any(axis=1)]
    return SeenSurface(chosen, corners[chosen], samples[seen])
