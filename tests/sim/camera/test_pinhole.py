"""Pinhole geometry against angles and points worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.camera.pinhole import (
    in_picture,
    intrinsics,
    project_px,
    ray_directions,
    tissue_from_camera,
)
from defras_sim.scene import Camera


def test_camera_looks_along_z_with_the_target_in_the_middle_of_the_picture(camera: Camera) -> None:
    pose = tissue_from_camera(camera)
    assert np.allclose(pose.rotation @ pose.rotation.T, np.eye(3))
    assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
    assert np.allclose(pose.rotation[:, 2], np.array([-0.17, 0.0, -0.20]) / np.hypot(0.17, 0.20))
    middle = project_px(camera, np.zeros((1, 3)))[0]
    assert np.allclose(middle, [159.5, 119.5])


def test_up_in_space_is_up_in_the_picture_and_the_right_hand_side_is_right(camera: Camera) -> None:
    middle, above, beside = project_px(camera, np.array([[0, 0, 0], [0, 0, 0.01], [0, 0.01, 0]]))
    assert above[1] < middle[1]
    # Seen from +x towards the origin, +y lies to the right.
    assert beside[0] > middle[0]


def test_vertical_field_of_view_spans_the_picture_height(camera: Camera) -> None:
    focal_px = intrinsics(camera)[1, 1]
    assert 2 * np.arctan(camera.height_px / 2 / focal_px) == pytest.approx(camera.vertical_fov_rad)


def test_projection_and_rays_are_inverse(camera: Camera) -> None:
    pixels = np.array([[0.0, 0.0], [319.0, 0.0], [12.0, 200.0]])
    points = np.array(camera.position_m) + 0.3 * ray_directions(camera, pixels)
    assert np.allclose(project_px(camera, points), pixels)
    assert in_picture(camera, points).all()


def test_points_behind_the_camera_or_beside_the_picture_are_not_in_it(camera: Camera) -> None:
    behind = np.array(camera.position_m) * 2
    assert not in_picture(camera, np.array([behind, [0.0, 0.5, 0.0]])).any()


def test_a_camera_that_looks_straight_down_is_refused() -> None:
    with pytest.raises(ValueError, match="no upright picture"):
        tissue_from_camera(Camera(position_m=(0, 0, 0.2), target_m=(0, 0, 0)))
