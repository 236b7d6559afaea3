"""Pictures of the PyBullet world, rendered without a graphics card."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_sim.camera.pinhole import intrinsics, tissue_from_camera
from defras_sim.scene import Camera
from defras_sim.worlds.protocol import CameraImage

_NEAR_M, _FAR_M = 0.02, 1.0
_NO_HIT_BEYOND_M = 0.999 * _FAR_M


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
        lightDirection=[0.2, 0.3, 1.0],
        lightAmbientCoeff=0.55,
        lightDiffuseCoeff=0.45,
        lightSpecularCoeff=0.05,
        renderer=client.ER_TINY_RENDERER,
    )
    shape = (camera.height_px, camera.width_px)
    rgb = np.reshape(np.asarray(rgba, np.uint8), (*shape, 4))[..., :3].copy()
    depth_m = None
    if rng is not None:
        raw = np.reshape(np.asarray(buffer, float), shape)
        depth_m = _FAR_M * _NEAR_M / (_FAR_M - (_FAR_M - _NEAR_M) * raw)
        depth_m += camera.noise_sd_m * rng.standard_normal(shape)
        depth_m[depth_m > _NO_HIT_BEYOND_M] = np.nan
    return CameraImage(time_s, rgb, depth_m, intrinsics(camera), pose)
