"""A twin that is told that its camera stands elsewhere sees points where they are."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.effects.camera_registration import EFFECT as REGISTRATION
from defras_sim.geometry import Pose
from defras_sim.resources import resource
from defras_sim.scene import ModelExtension, Scene, load_scene
from defras_sim.twin import Twin
from defras_sim.worlds.protocol import PointCloud


def moved(shift_m: tuple[float, float, float], turn_rad: tuple[float, float, float]) -> Pose:
    return Pose(np.array(shift_m)).moved(np.zeros(3), np.array(turn_rad))


FIRST = moved((0.002, -0.001, 0.003), (0.01, 0.02, -0.015))
SECOND = moved((-0.004, 0.002, 0.001), (-0.02, 0.005, 0.03))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(resource("sim/scenes/demo.yaml"))


def test_the_parameters_of_a_placement_are_found(scene: Scene) -> None:
    for placed in (FIRST, SECOND, FIRST @ SECOND):
        values = REGISTRATION.values_of(placed, scene.depth_camera)
        again = REGISTRATION.placement(values, scene.depth_camera)
        np.testing.assert_allclose(again.position_m, placed.position_m, atol=1e-12)
        np.testing.assert_allclose(again.rotation, placed.rotation, atol=1e-12)


def test_registrations_add_up(scene: Scene) -> None:
    twin = Twin(scene)
    surface = twin.state.surface
    points_m = depth_cloud_m(
        scene.depth_camera, surface, RayCaster(surface), np.random.default_rng(0)
    )
    reported = PointCloud(1.0, FIRST.apply(SECOND.apply(points_m)))
    twin.register_camera(FIRST.inverse())
    np.testing.assert_allclose(
        twin.corrected(reported).points_m, SECOND.apply(points_m), atol=1e-12
    )
    twin.register_camera(SECOND.inverse())
    np.testing.assert_allclose(twin.corrected(reported).points_m, points_m, atol=1e-12)
    assert list(twin.scene.model.extension) == ["camera_registration"]


def test_other_effects_of_the_scene_stay(scene: Scene) -> None:
    model = ModelExtension.of({"depth_bias": {"offset_m": 0.001}, "camera_latency": {}})
    twin = Twin(scene.model_copy(update={"model": model}))
    twin.register_camera(FIRST)
    assert list(twin.scene.model.extension) == [
        "depth_bias",
        "camera_latency",
        "camera_registration",
    ]


def test_no_camera_is_off_by_a_hand(scene: Scene) -> None:
    twin = Twin(scene)
    with pytest.raises(ValueError, match=r"x_m should be between -0\.05 and 0\.05 m"):
        twin.register_camera(Pose(np.array([0.1, 0.0, 0.0])))
    assert twin.scene is scene
