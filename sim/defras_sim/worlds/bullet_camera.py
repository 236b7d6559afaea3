"""Pictures of the PyBullet world, rendered without a graphics card."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.geometry import Floats
from defras_sim.scene import Camera
from defras_sim.worlds.protocol import CameraImage

_NEAR_M, _FAR_M = 0.02, 1.0
_NO_HIT_BEYOND_M = 0.999 * _FAR_M
_AMBIENT = 0.35
_BACKGROUND = 0.12
_TO_LAMP = np.array([0.35, -0.45, -0.82])
"""Unit vector in the camera's frame (x right, y down, z forward): up and to the right."""


def take_picture(
    client: Any, camera: Camera, time_s: float, rng: np.random.Generator | None
) -> CameraImage:
    """A colour picture; with ``rng`` also depth, with the camera's noise along the axis."""
    pose = tissue_from_camera(camera)
    view = client.computeViewMatrix(list(camera.position_m), list(camera.target_m), [0, 0, 1])
    projection = client.computeProjectionMatrixFOV(
        np.degrees(camera.vertical_fov_rad), camera.width_px / camera.height_px, _NEAR_M, _FAR_M
    )
    _, _, rgba, buffer, _ = client.getCameraImage(
        camera.width_px,
        camera.height_px,
        view,
        projection,
        shadow=0,
        lightAmbientCoeff=1.0,
        lightDiffuseCoeff=0.0,
        lightSpecularCoeff=0.0,
        renderer=client.ER_TINY_RENDERER,
    )
    shape = (camera.height_px, camera.width_px)
    flat = np.reshape(np.asarray(rgba, np.uint8), (*shape, 4))[..., :3]
    raw = np.reshape(np.asarray(buffer, float), shape)
    exact_m = _FAR_M * _NEAR_M / (_FAR_M - (_FAR_M - _NEAR_M) * raw)
    matrix = intrinsics(camera)
    rgb = _lit(flat, exact_m, matrix)
    depth_m = None
    if rng is not None:
        depth_m = exact_m + camera.noise_sd_m * rng.standard_normal(shape)
        depth_m[exact_m > _NO_HIT_BEYOND_M] = np.nan
    return CameraImage(time_s, rgb, depth_m, matrix, pose)


def _lit(flat: NDArray[np.uint8], depth_m: Floats, intrinsics: Floats) -> NDArray[np.uint8]:
    """Shade flat colours (h, w, 3) by a lamp beside the camera, with normals from the depth.

    PyBullet shades a soft body by normals averaged over its sharp edges, and shows no folds.
    """
    rows, columns = np.indices(depth_m.shape)
    rays = np.stack(
        [
            (columns - intrinsics[0, 2]) / intrinsics[0, 0],
            (rows - intrinsics[1, 2]) / intrinsics[1, 1],
            np.ones(depth_m.shape),
        ],
        axis=-1,
    )
    points = rays * depth_m[..., None]
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    length = np.linalg.norm(normal, axis=-1)
    facing = np.abs(normal @ _TO_LAMP) / np.maximum(length, 1e-12)
    shade = _AMBIENT + (1 - _AMBIENT) * facing
    shade[depth_m > _NO_HIT_BEYOND_M] = _BACKGROUND
    return np.clip(flat * shade[..., None], 0, 255).astype(np.uint8)
