"""PyBullet's world is as wrong as its scene says, as far as it can be."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.effect import Extension
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.worlds.bullet_effects import in_bullet
from defras_sim.worlds.bullet_world import BulletWorld
from defras_sim.worlds.error import CannotImitate
from defras_sim.worlds.protocol import (
    JAW_CLOSED_RAD,
    JAW_OPEN_RAD,
    ArmCommand,
    CameraImage,
    Command,
)

LIFT_M = 0.02


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Held along the largest x, on a coarse mesh; PSM1 starts at the free edge and feels forces."""
    plain = Scene(
        name="right side",
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.01, center_y_m=0.0),
    )
    changes = {"home_tip_m": (-0.05, 0.02, 0.0), "force_noise_sd_n": 0.0}
    coarse = {"bullet_elements_xyz": (8, 8, 1)}
    camera = {"width_px": 64, "height_px": 48, "noise_sd_m": 0.0}
    return plain.model_copy(
        update={
            "simulation": plain.simulation.model_copy(update=coarse),
            "arms": {**plain.arms, "psm1": plain.arms["psm1"].model_copy(update=changes)},
            "depth_camera": plain.depth_camera.model_copy(update=camera),
        }
    )


def lifted(scene: Scene, actual: Extension) -> BulletWorld:
    """A world in which PSM1 has taken the free edge and lifted it."""
    world = BulletWorld(scene.extended(actual), np.random.default_rng(0))

    def do(command: ArmCommand, ticks: int) -> None:
        for _ in range(ticks):
            world.command(Command({"psm1": command}))
            world.step()

    do(ArmCommand(jaw_rad=JAW_OPEN_RAD), 5)
    do(ArmCommand(jaw_rad=JAW_CLOSED_RAD), 5)
    do(ArmCommand(linear_m_s=np.array([0.0, 0.0, 0.04])), 10)
    do(ArmCommand(), 4)
    return world


def points_m(image: CameraImage) -> Floats:
    """Points (n, 3) of a depth picture, tissue frame."""
    assert image.depth_m is not None
    rows, columns = np.nonzero(np.isfinite(image.depth_m))
    pixels = np.column_stack([columns, rows, np.ones(len(rows))])
    rays = pixels @ np.linalg.inv(image.intrinsics).T
    return image.tissue_from_camera.apply(rays * image.depth_m[rows, columns, None])


def test_a_wrong_registration_slip_and_camera_show_where_they_should(scene: Scene) -> None:
    camera = {"camera_registration": {"x_m": 0.01}, "depth_bias": {"scale": 1.02}}
    hidden: Extension = {
        "tool_offset": {"y_m": -0.01},
        "grasp_slip": {"distance_m": 0.008, "time_s": 0.8},
        "camera_latency": {"delay_s": 0.2},
        **camera,
    }
    plain, wrong = lifted(scene, {}), lifted(scene, hidden)
    try:
        seen, unlike = plain.observe(), wrong.observe()
        tip, setpoint = (
            unlike.arms["psm1"].tissue_from_tip.position_m,
            unlike.arms["psm1"].setpoint_tissue_from_tip.position_m,
        )
        assert tip == pytest.approx(setpoint, abs=2e-4), "encoders know nothing of it"
        assert unlike.arms["psm1"].grasped

        heights = [world.true_surface().vertices_m[:, 2].max() for world in (plain, wrong)]
        assert heights[0] - heights[1] == pytest.approx(0.008, abs=0.003), "it slipped"

        felt = [seen.arms["psm1"].force_n, unlike.arms["psm1"].force_n]
        assert felt[0] is not None
        assert felt[0][2] > 0.0, "the jaw pulls the tissue up"
        assert np.linalg.norm(felt[0]) == pytest.approx(plain.true_force_n())
        assert np.linalg.norm(felt[1]) < np.linalg.norm(felt[0])

        assert seen.depth_image is not None
        assert unlike.depth_image is not None
        assert seen.depth_image.stamp_s <= seen.time_s
        placed = unlike.depth_image.tissue_from_camera.position_m
        assert placed - tissue_from_camera(scene.depth_camera).position_m == pytest.approx(
            [0.01, 0.0, 0.0]
        )
        # Around the tissue lies the bed, at rest in both: there only the camera differs.
        layer = CameraLayer(scene.depth_camera, Layers.of(camera).camera)
        bed_m = -scene.tissue.thickness_m
        low = np.percentile(layer.corrected(points_m(unlike.depth_image))[:, 2], 10)
        assert low == pytest.approx(bed_m, abs=0.002)
        assert abs(np.percentile(points_m(unlike.depth_image)[:, 2], 10) - bed_m) > 0.003
    finally:
        plain.close()
        wrong.close()


def test_another_slab_is_imitated_and_anything_more_is_refused_by_name(scene: Scene) -> None:
    stiffer = Layers.of({"stiffness": {"scale": 2.0}})
    assert in_bullet(scene, stiffer).tissue.young_modulus_pa == pytest.approx(6000.0)
    with pytest.raises(CannotImitate, match=r"the effect stress_relaxation .*\(--world model\)"):
        BulletWorld(
            scene.extended({"stress_relaxation": {"fraction": 0.3}}), np.random.default_rng(0)
        )
