"""The depth camera: a point cloud of the tissue by ray casting."""

from __future__ import annotations

import numpy as np

from defras_sim.camera.pinhole import project_px, ray_directions
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats
from defras_sim.scene import Camera
from defras_sim.surface import Surface

# Rays over the box around the tissue; most of them hit it.
CLOUD_RAYS = 1450


def depth_cloud_m(
    camera: Camera,
    surface: Surface,
    tissue: RayCaster,
    rng: np.random.Generator,
    rays: int = CLOUD_RAYS,
) -> Floats:
    """Points (n, 3) that the camera sees of the tissue, in the tissue frame.

    About ``rays`` pixels, on a lattice over the part of the picture that holds the tissue, are
    asked; each that meets tissue gives a point. Noise of ``camera.noise_sd_m`` acts along the ray.
    An empty cloud (0, 3) means that the tissue is out of the picture.
    """
    pixels = _lattice(camera, surface.vertices_m, rays)
    origin = np.array(camera.position_m)
    directions = ray_directions(camera, pixels)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    distance = tissue.hits(origin, directions)
    hit = np.isfinite(distance)
    distance = distance[hit] + camera.noise_sd_m * rng.standard_normal(int(hit.sum()))
    return origin + distance[:, None] * directions[hit]


def _lattice(camera: Camera, vertices_m: Floats, rays: int) -> Floats:
    """Pixels (n, 2) evenly over the box around the projected vertices, clipped to the picture."""
    projected = project_px(camera, vertices_m)
    projected = projected[np.isfinite(projected).all(axis=1)]
    if len(projected) == 0:
        return np.zeros((0, 2))
    last = np.array([camera.width_px - 1, camera.height_px - 1])
    low = np.clip(projected.min(axis=0), 0, last)
    high = np.clip(projected.max(axis=0), 0, last)
    if np.any(high - low < 1.0):
        return np.zeros((0, 2))
    stride = max(1.0, float(np.sqrt(np.prod(high - low) / rays)))
    columns: Floats = np.unique(np.rint(np.arange(low[0], high[0], stride)))
    rows: Floats = np.unique(np.rint(np.arange(low[1], high[1], stride)))
    return np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
