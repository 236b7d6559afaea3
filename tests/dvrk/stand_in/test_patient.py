"""The patient under the stand-in's arms: its tools go where the tips truly are."""

import numpy as np
import pytest

from defras_bt.benchmark.fault_cases import patient as scene_of_a_patient
from defras_bt.dvrk.stand_in.imperfections import Imperfections
from defras_bt.dvrk.stand_in.patient import Patient, TipTarget, patient_scene
from defras_sim.geometry import Pose
from defras_sim.worlds.kinematic_tool import JAW_ON_TISSUE_RAD, POINTING_DOWN
from defras_sim.worlds.model_world import ModelWorld

TICK_S = 0.02
SCENE = scene_of_a_patient()


def a_patient(imperfections: Imperfections | None = None) -> Patient:
    world = ModelWorld(patient_scene(SCENE, TICK_S), np.random.default_rng(0))
    return Patient(world, SCENE, imperfections or Imperfections(), np.random.default_rng(1))


def lead(patient: Patient, points_m: np.ndarray, jaw_rad: float) -> dict:
    felt = {}
    for point_m in points_m:
        felt = patient.step({"psm1": TipTarget(Pose(point_m, POINTING_DOWN), jaw_rad)})
    return felt


def test_a_jaw_that_closes_on_tissue_holds_it_and_feels_its_pull():
    patient = a_patient()
    start = np.array(SCENE.arms["psm1"].home_tip_m)
    patient.start_at({"psm1": Pose(start, POINTING_DOWN)})
    grasp = SCENE.grasp_point_m(2, 4)
    # From the side, a step each tick; where the tool is, only the way from the start tells.
    lead(patient, np.linspace(start, grasp, 40), 0.8)
    felt = lead(patient, np.tile(grasp, (20, 1)), 0.0)["psm1"]
    assert felt.grasped
    assert felt.jaw_rad == pytest.approx(JAW_ON_TISSUE_RAD)
    lifted = lead(patient, np.linspace(grasp, grasp + [0, 0, 0.02], 30), 0.0)["psm1"]
    # Lifting tissue, the jaw pulls it up.
    assert lifted.force_n[2] > 0.005
    surface = patient.world.true_surface()
    nearest = np.linalg.norm(surface.vertices_m - (grasp + [0, 0, 0.02]), axis=1).min()
    assert nearest < 0.012
    let_go = lead(patient, np.tile(grasp + [0, 0, 0.02], (20, 1)), 0.8)["psm1"]
    assert not let_go.grasped
    assert let_go.force_n == pytest.approx(np.zeros(3))


def test_pictures_come_when_they_are_due_and_late_ones_later():
    prompt = a_patient()
    late = a_patient(
        Imperfections.model_validate({"effects": [{"effect": "camera_latency", "delay_s": 0.04}]})
    )
    at = {"psm1": TipTarget(Pose(np.array(SCENE.arms["psm1"].home_tip_m), POINTING_DOWN), 0.0)}
    times_s: dict[str, list[float]] = {"prompt": [], "late": []}
    for _ in range(26):
        for name, patient in (("prompt", prompt), ("late", late)):
            image = patient.pictures().depth
            if image is not None:
                times_s[name].append(image.stamp_s)
            patient.step(at)
    assert times_s["prompt"] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    # The first comes at once; then each has the stamp of when it came, as a late driver gives.
    assert times_s["late"] == pytest.approx([0.0, 0.14, 0.24, 0.34, 0.44])
