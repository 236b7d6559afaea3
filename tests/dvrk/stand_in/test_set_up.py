"""The files that reach the stand-in say what it is, imperfections and all."""

from datetime import UTC, datetime

import numpy as np
import pytest

from defras_bt.dvrk.registering.registration import read_registration
from defras_bt.dvrk.settings import load_setup
from defras_bt.dvrk.stand_in.imperfections import Imperfections, read_imperfections
from defras_bt.dvrk.stand_in.patient import patient_scene
from defras_bt.dvrk.stand_in.set_up import registration_of, set_up_of, write_set_up
from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.resources import resource
from defras_sim.scene import load_scene
from defras_sim.yaml_source import InvalidFile

SCENE = load_scene(resource("sim/scenes/demo.yaml"))
NOW = datetime(2026, 1, 1, tzinfo=UTC)


def test_they_are_read_back_as_they_were_meant(tmp_path):
    setup = set_up_of("http://127.0.0.1:11500", SCENE)
    registration = registration_of(SCENE, Imperfections(), NOW)
    file = write_set_up(tmp_path / "lab", setup, registration, SCENE)
    assert load_scene(file.with_name("scene.yaml")) == SCENE
    read = load_setup(file)
    assert read.transport == setup.transport
    assert read.arms == setup.arms
    assert read.cameras == setup.cameras
    placed = read_registration(read.registration)
    for name, arm in SCENE.arms.items():
        assert placed.arms[name].pose.position_m == pytest.approx(arm.rcm_m)
    depth = placed.cameras["depth"].pose
    assert depth.rotation == pytest.approx(tissue_from_camera(SCENE.depth_camera).rotation)


def test_an_unregistered_camera_shows_in_the_registration_by_as_much():
    imperfect = Imperfections.model_validate(
        {"effects": [{"effect": "camera_registration", "x_m": 0.002, "turn_z_rad": 0.01}]}
    )
    true = tissue_from_camera(SCENE.depth_camera)
    believed = registration_of(SCENE, imperfect, NOW).cameras["depth"].pose
    # It turns about the point that the camera looks at, which is therefore shifted and no more.
    seen = believed.apply(true.inverse().apply(np.array(SCENE.depth_camera.target_m)))
    assert seen - SCENE.depth_camera.target_m == pytest.approx([0.002, 0, 0], abs=1e-9)
    turn = believed.rotation @ true.rotation.T
    assert np.arccos((np.trace(turn) - 1) / 2) == pytest.approx(0.01, abs=1e-6)


def test_the_laboratory_s_imperfections_are_of_arms_and_cameras_only(tmp_path):
    lab = read_imperfections("lab")
    assert {"servo_lag", "joint_play", "joint_coupling", "tool_offset"} <= set(lab.extension)
    assert lab.force_noise_sd_n == 2.0
    assert read_imperfections("none") == Imperfections()
    file = tmp_path / "bad.yaml"
    file.write_text("effects:\n  - {effect: stiffness, scale: 1.2}\n")
    with pytest.raises(InvalidFile, match="actual scene"):
        read_imperfections(str(file))


def test_the_patient_keeps_its_own_effects_and_leaves_those_of_the_arms():
    actual = SCENE.extended(
        {"servo_lag": {"q1_s": 0.05}, "stiffness": {"scale": 1.2}, "camera_latency": {"delay_s": 1}}
    )
    patient = patient_scene(actual, 0.02)
    assert set(patient.model.extension) == {"stiffness"}
    assert patient.tick_s == 0.02
    assert all(arm.force_noise_sd_n == 0.0 for arm in patient.arms.values())
