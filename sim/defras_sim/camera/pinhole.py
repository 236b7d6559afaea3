"""Pinhole geometry of a scene's camera, shared by ray-cast and rendered pictures.

Convention as in OpenCV: the camera looks along +z, x points right and y down in the picture.
"""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera


def tissue_from_camera(camera: Camera) -> Pose:
    """Where the camera stands; the tissue frame's z axis points up in its picture.

    Raises:
        ValueError: the camera looks straight up or down, or at its own position.
    """
    return looking_at(np.array(camera.position_m), np.array(camera.target_m))


def looking_at(position_m: Floats, target_m: Floats) -> Pose:
    """tissue_from_camera of a camera at ``position_m`` (3,) with ``target_m`` (3,) in the middle.

    Raises:
        ValueError: the camera looks straight up or down, or at its own position.
    """
    forward = target_m - position_m
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-9:
        raise ValueError(
            f"a camera at {position_m} that looks at {target_m} has no upright "
            "picture; move its position or target off the common vertical line"
        )
    forward /= np.linalg.norm(forward)
    right /= np.linalg.norm(right)
    return Pose(position_m, np.stack([right, np.cross(forward, right), forward], axis=1))


def intrinsics(camera: Camera) -> Floats:
    """Matrix (3, 3) from camera coordinates to pixels; (0, 0) is the top left pixel's centre."""
    focal_px = camera.height_px / 2 / np.tan(camera.vertical_fov_rad / 2)
    return np.array(
        [
            [focal_px, 0.0, (camera.width_px - 1) / 2],
            [0.0, focal_px, (camera.height_px - 1) / 2],
            [0.0, 0.0, 1.0],
        ]
    )


def project_px(camera: Camera, points_m: Floats) -> Floats:
    """Picture coordinates (n, 2) of tissue-frame points (n, 3); NaN behind the camera."""
    seen = tissue_from_camera(camera).inverse().apply(points_m)
    depth = np.where(seen[:, 2] > 1e-9, seen[:, 2], np.nan)
    return (seen / depth[:, None] @ intrinsics(camera).T)[:, :2]


def in_picture(camera: Camera, points_m: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which tissue-frame points (n, 3) fall on a pixel, hidden or not."""
    pixels = project_px(camera, points_m)
    size = np.array([camera.width_px, camera.height_px])
    return np.all((pixels >= -0.5) & (pixels <= size - 0.5), axis=1)


def ray_directions(camera: Camera, pixels: Floats) -> Floats:
    """Directions (n, 3) in the tissue frame through pixels (n, 2), of depth 1 along the axis."""
    homogeneous = np.column_stack([pixels, np.ones(len(pixels))])
    in_camera = homogeneous @ np.linalg.inv(intrinsics(camera)).T
    return in_camera @ tissue_from_camera(camera).rotation.T
