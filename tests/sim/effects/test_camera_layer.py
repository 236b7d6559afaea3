"""What a wrong camera reports, checked against where a camera standing elsewhere would see it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.camera.pinhole import in_picture, project_px, tissue_from_camera
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.camera_registration import EFFECT as REGISTRATION
from defras_sim.effects.depth_bias import EFFECT as BIAS
from defras_sim.geometry import Pose
from defras_sim.scene import Camera
from defras_sim.worlds.protocol import CameraImage

CAMERA = Camera(position_m=(0.17, 0.0, 0.20), target_m=(0.01, 0.0, 0.0))
SHIFT = {"x_m": 0.003, "y_m": -0.001, "turn_z_rad": 0.04}
BIASED = {"scale": 1.012, "offset_m": 0.002}


@pytest.fixture
def points_m() -> np.ndarray:
    return np.random.default_rng(0).uniform(-0.05, 0.05, (200, 3))


def test_at_null_values_it_reports_what_is_there(points_m: np.ndarray) -> None:
    null = [(effect, effect.complete({})) for effect in (REGISTRATION, BIAS)]
    layer = CameraLayer(CAMERA, null)
    assert np.allclose(layer.reported(points_m), points_m, rtol=0, atol=1e-15)
    assert CameraLayer(CAMERA, []).reported(points_m) is points_m
    assert CameraLayer(CAMERA, []).corrected(points_m) is points_m


@pytest.mark.parametrize("effects", [[0], [1], [0, 1]])
def test_correcting_undoes_reporting(points_m: np.ndarray, effects: list[int]) -> None:
    both = [(REGISTRATION, SHIFT), (BIAS, BIASED)]
    layer = CameraLayer(CAMERA, [both[i] for i in effects])
    reported = layer.reported(points_m)
    assert np.linalg.norm(reported - points_m, axis=1).min() > 1e-4
    assert np.allclose(layer.corrected(reported), points_m, rtol=0, atol=1e-12)


def test_a_wrong_registration_turns_about_the_point_looked_at_and_keeps_shapes(
    points_m: np.ndarray,
) -> None:
    layer = CameraLayer(CAMERA, [(REGISTRATION, SHIFT)])
    target = np.array(CAMERA.target_m)
    shift = np.array([0.003, -0.001, 0.0])
    assert np.allclose(layer.reported(target[None])[0], target + shift, atol=1e-15)
    turned = Rotation.from_euler("z", 0.04).apply(points_m - target) + target + shift
    assert np.allclose(layer.reported(points_m), turned, atol=1e-15)


def test_a_biased_depth_keeps_every_point_on_its_pixel(points_m: np.ndarray) -> None:
    layer = CameraLayer(CAMERA, [(BIAS, BIASED)])
    reported = layer.reported(points_m)
    assert in_picture(CAMERA, points_m).any()
    before, after = project_px(CAMERA, points_m), project_px(CAMERA, reported)
    assert np.allclose(after, before, rtol=0, atol=1e-9)
    to_camera = tissue_from_camera(CAMERA).inverse()
    depth = to_camera.apply(points_m)[:, 2]
    assert np.allclose(to_camera.apply(reported)[:, 2], 1.012 * depth + 0.002, atol=1e-15)


def test_pictures_and_points_are_wrong_alike(points_m: np.ndarray) -> None:
    layer = CameraLayer(CAMERA, [(REGISTRATION, SHIFT), (BIAS, BIASED)])
    pose = tissue_from_camera(CAMERA)
    seen = pose.inverse().apply(points_m)
    depth_m = seen[:, 2].reshape(10, 20)
    image = CameraImage(0.0, np.zeros((10, 20, 3), np.uint8), depth_m, np.eye(3), pose)
    reported = layer.reported_image(image)
    rays = seen / seen[:, 2:]
    from_picture = reported.tissue_from_camera.apply(rays * reported.depth_m.reshape(-1, 1))
    assert np.allclose(from_picture, layer.reported(points_m), atol=1e-12)
    plain = CameraImage(0.0, image.rgb, None, np.eye(3), Pose(np.zeros(3)))
    assert layer.reported_image(plain) is plain
