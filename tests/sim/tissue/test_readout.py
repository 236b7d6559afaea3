"""What a state says adds up: forces and moments balance, and forces are slopes of the energy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.state import TissueState

TIPS = {
    "psm1": Pose(np.array([0.04, 0.035, 0.0])),
    "psm2": Pose(np.array([0.035, -0.03, 0.0])),
}
MOVED = {
    "psm1": Pose(np.array([0.02, 0.03, 0.03]), Rotation.from_rotvec([0.3, -0.8, 0.4]).as_matrix()),
    "psm2": Pose(np.array([0.045, -0.02, 0.012])),
}


def held(material: str, gravity_m_s2: float = 9.81) -> tuple[TissueModel, TissueState]:
    """Two arms hold heavy tissue that lies on its bed, one of them turned by some 50 degrees."""
    scene = Scene(
        name="held",
        attachments=Attachments(map=("##..........",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(gravity_m_s2=gravity_m_s2),
    )
    tissue = TissueModel(scene, elements_xyz=(6, 6, 1), material=material, residual_share=1e-8)
    for arm, tip in TIPS.items():
        tissue.grasp(arm, tip)
    state = tissue.solve(MOVED)
    assert state.converged
    return tissue, state


@pytest.mark.parametrize("material", ["neo_hookean", "corotational"])
def test_everything_outside_the_tissue_is_in_balance(material: str) -> None:
    _, state = held(material)
    assert set(state.wrenches) == {
        "gravity", "bed", "attachments", "grasp of psm1", "grasp of psm2"
    }  # fmt: skip
    force = sum(wrench.force_n for wrench in state.wrenches.values())
    moment = sum(wrench.moment_nm for wrench in state.wrenches.values())
    np.testing.assert_allclose(force, 0.0, atol=1e-7)
    for about in np.random.default_rng(0).normal(0, 0.1, (3, 3)):
        np.testing.assert_allclose(moment - np.cross(about, force), 0.0, atol=2e-8)
    weight = 1000.0 * 9.81 * 0.12 * 0.12 * 0.005
    np.testing.assert_allclose(state.wrenches["gravity"].force_n, [0, 0, -weight], rtol=1e-12)


def test_forces_by_name_are_those_of_arms_and_holes() -> None:
    _, state = held("neo_hookean")
    for arm, tip in MOVED.items():
        wrench = state.wrenches[f"grasp of {arm}"]
        np.testing.assert_allclose(wrench.force_n, state.grasp_forces_n[arm], atol=1e-12)
        about_tip = wrench.moment_nm - np.cross(tip.position_m, wrench.force_n)
        np.testing.assert_allclose(about_tip, state.grasp_moments_nm[arm], atol=1e-12)
    attachments = state.wrenches["attachments"]
    np.testing.assert_allclose(
        attachments.force_n, state.attachment_forces_n.sum(axis=0), atol=1e-12
    )
    np.testing.assert_array_equal(state.bed_force_n, state.wrenches["bed"].force_n)
    assert state.bed_force_n[2] > 0.1
    np.testing.assert_allclose(state.bed_force_n[:2], 0.0, atol=1e-15)


def test_a_tissue_without_bed_has_no_bed_force() -> None:
    scene = Scene(
        name="floating",
        attachments=Attachments(map=("##..........",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(bed=False),
    )
    state = TissueModel(scene, elements_xyz=(4, 4, 1)).solve({})
    np.testing.assert_array_equal(state.bed_force_n, np.zeros(3))


@pytest.mark.parametrize("arm", MOVED)
def test_force_and_moment_are_the_work_of_a_small_motion(arm: str) -> None:
    """Virtual work: the energy of tissue, bed, weight and springs changes by F dx + M dphi."""
    tissue, state = held("neo_hookean")
    step = 1e-5

    def energy_j(motion: np.ndarray) -> float:
        tip = MOVED[arm].moved(motion[:3], motion[3:])
        there = tissue.solve({**MOVED, arm: tip})
        assert there.converged
        return sum(term.energy_and_gradient(there.nodes_m)[0] for term in tissue.terms.values())

    pull = np.concatenate([state.grasp_forces_n[arm], state.grasp_moments_nm[arm]])
    steps = step * np.eye(6)
    work = np.array([(energy_j(s) - energy_j(-s)) / (2 * step) for s in steps])
    np.testing.assert_allclose(work[:3], pull[:3], atol=1e-4 * np.abs(pull[:3]).max())
    np.testing.assert_allclose(work[3:], pull[3:], atol=1e-4 * np.abs(pull[3:]).max())


def test_strain_energy_is_the_work_done_on_weightless_tissue() -> None:
    """Slowly lifted: the tip's work goes into strain, apart from the springs of the grip."""
    tissue, _ = held("neo_hookean", gravity_m_s2=0.0)
    way = [TIPS["psm2"].moved(np.array([0.0, 0.0, z])) for z in np.linspace(0.0, 0.02, 21)]
    tissue.reset()
    tissue.grasp("psm2", way[0])
    states = [tissue.solve({"psm2": tip}) for tip in way]
    forces = np.array([state.grasp_forces_n["psm2"][2] for state in states])
    work_j = float(np.trapezoid(forces, dx=0.001))
    assert states[-1].strain_energy_j == pytest.approx(work_j, rel=0.02)
    assert states[0].strain_energy_j < 1e-9
