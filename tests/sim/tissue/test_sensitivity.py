"""Derivatives of an equilibrium against differences between equilibria."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.bed import Bed
from defras_sim.tissue.loads import DeadLoad
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.parameters import (
    GRAVITY_M_S2,
    POISSON_RATIO,
    YOUNG_MODULUS_SCALE,
    HoleStiffness,
    Parameter,
    TermParameter,
    TipMotion,
)
from defras_sim.tissue.sensitivity import Sensitivities
from defras_sim.tissue.state import TissueState

MATERIALS = ["corotational", "neo_hookean"]
TIPS = {
    "psm1": Pose(np.array([0.04, 0.03, 0.0])),
    "psm2": Pose(np.array([0.04, -0.03, 0.0])),
}
TURN = Rotation.from_rotvec([0.1, -0.4, 0.2]).as_matrix()
RAISED = {
    "psm1": Pose(np.array([0.030, 0.025, 0.025]), TURN),
    "psm2": Pose(np.array([0.042, -0.030, 0.008])),
}
YOUNG_PA, POISSON = 3000.0, 0.45
SOFT_HOLE, RIGID_HOLE, FREE_HOLE = 13, 36, 67
MODE = "one_half"


def scene() -> Scene:
    return Scene(
        name="two grasps over a bed",
        attachments=Attachments(map=("##..........",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(gravity_m_s2=4.0, young_modulus_pa=YOUNG_PA, poisson_ratio=POISSON),
    )


def raised(material: str) -> TissueModel:
    """Held by two arms, on its bed, solved to rounding."""
    tissue = TissueModel(scene(), elements_xyz=(5, 5, 1), material=material, residual_share=1e-11)
    body = tissue.terms["material"]
    assert isinstance(body, ElasticBody)
    half = body.points.now_m(tissue.mesh.nodes_m)[:, :, 0] > 0
    tissue.set_term(
        ElasticBody(
            body.mesh, body.material, body.mu_pa, body.lam_pa, modes={MODE: half.astype(float)}
        )
    )
    stiffness = tissue.hole_stiffness_n_per_m
    stiffness[SOFT_HOLE] = 60.0
    tissue.set_hole_stiffness(stiffness)
    for arm, tip in TIPS.items():
        tissue.grasp(arm, tip)
    state = tissue.solve(RAISED)
    assert state.converged
    assert state.bed_force_n[2] > 0.05
    return tissue


@pytest.fixture(scope="module", params=MATERIALS)
def tissue(request: pytest.FixtureRequest) -> TissueModel:
    return raised(request.param)


def with_poisson(tissue: TissueModel, change: float) -> TissueState:
    body = tissue.terms["material"]
    assert isinstance(body, ElasticBody)
    lame = lame_parameters(body.material, YOUNG_PA, POISSON + change)
    tissue.set_term(body.with_lame(*lame))
    state = tissue.solve(RAISED)
    tissue.set_term(body)
    return state


def with_mode(tissue: TissueModel, strength: float) -> TissueState:
    body = tissue.terms["material"]
    assert isinstance(body, ElasticBody)
    scale = 1 + strength * body.modes[MODE]
    tissue.set_term(body.with_lame(scale * body.mu_pa, scale * body.lam_pa))
    state = tissue.solve(RAISED)
    tissue.set_term(body)
    return state


def with_thickness(tissue: TissueModel, change: float) -> TissueState:
    body = tissue.terms["material"]
    assert isinstance(body, ElasticBody)
    tissue.set_term(body.with_points(body.points.thickened(1 + change)))
    state = tissue.solve(RAISED)
    tissue.set_term(body)
    return state


def with_gravity(tissue: TissueModel, change: float) -> TissueState:
    load = tissue.terms["gravity"]
    assert isinstance(load, DeadLoad)
    tissue.set_term(replace(load, strength=load.strength + change))
    state = tissue.solve(RAISED)
    tissue.set_term(load)
    return state


def with_bed(tissue: TissueModel, change: float) -> TissueState:
    bed = tissue.terms["bed"]
    assert isinstance(bed, Bed)
    tissue.set_term(replace(bed, height_m=bed.height_m + change))
    state = tissue.solve(RAISED)
    tissue.set_term(bed)
    return state


def with_hole(hole: int) -> Callable[[TissueModel, float], TissueState]:
    def changed(tissue: TissueModel, change: float) -> TissueState:
        stiffness = tissue.hole_stiffness_n_per_m
        other = stiffness.copy()
        other[hole] += change
        tissue.set_hole_stiffness(other)
        state = tissue.solve(RAISED)
        tissue.set_hole_stiffness(stiffness)
        return state

    return changed


def with_all_holes(tissue: TissueModel, change: float) -> TissueState:
    stiffness = tissue.hole_stiffness_n_per_m
    tissue.set_hole_stiffness((1 + change) * stiffness)
    state = tissue.solve(RAISED)
    tissue.set_hole_stiffness(stiffness)
    return state


CASES: dict[str, tuple[Parameter, float, Callable[[TissueModel, float], TissueState]]] = {
    "poisson": (POISSON_RATIO, 1e-4, with_poisson),
    "mode": (TermParameter("material", MODE), 1e-4, with_mode),
    "thickness": (TermParameter("material", "thickness_scale"), 1e-4, with_thickness),
    "gravity": (GRAVITY_M_S2, 1e-3, with_gravity),
    "bed": (TermParameter("bed", "height_m"), 1e-7, with_bed),
    "soft hole": (HoleStiffness(SOFT_HOLE), 0.05, with_hole(SOFT_HOLE)),
    "rigid hole": (HoleStiffness(RIGID_HOLE), 10.0, with_hole(RIGID_HOLE)),
    "all holes": (TermParameter("attachments", "stiffness_scale"), 1e-3, with_all_holes),
}


def columns_of(by: Sensitivities, which: slice) -> dict[str, np.ndarray]:
    """Everything that is differentiated, for some columns."""
    return {
        "nodes": by.nodes_by[:, :, which],
        "surface": by.surface_by[:, :, which],
        "attachments": by.attachment_forces_by[:, :, which],
        "bed": by.bed_force_by[:, which],
        **{f"force {arm}": f[:, which] for arm, f in by.grasp_forces_by.items()},
        **{f"moment {arm}": m[:, which] for arm, m in by.grasp_moments_by.items()},
    }


def difference(up: TissueState, down: TissueState, width: float) -> dict[str, np.ndarray]:
    def slope(name: str, arm: str | None = None) -> np.ndarray:
        ends = [getattr(state, name) for state in (up, down)]
        if arm is not None:
            ends = [end[arm] for end in ends]
        return (ends[0] - ends[1]) / width

    return {
        "nodes": slope("nodes_m"),
        "surface": (up.surface.vertices_m - down.surface.vertices_m) / width,
        "attachments": slope("attachment_forces_n"),
        "bed": slope("bed_force_n"),
        **{f"force {arm}": slope("grasp_forces_n", arm) for arm in TIPS},
        **{f"moment {arm}": slope("grasp_moments_nm", arm) for arm in TIPS},
    }


def assert_alike(found: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> None:
    for name, slope in expected.items():
        error = np.linalg.norm(found[name] - slope)
        assert error < 2e-3 * np.linalg.norm(slope), (name, error, np.linalg.norm(slope))


@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_slopes_between_equilibria(tissue: TissueModel, name: str) -> None:
    parameter, step, changed = CASES[name]
    tissue.solve(RAISED)
    by = tissue.sensitivities([parameter])
    up, down = changed(tissue, step), changed(tissue, -step)
    assert up.converged
    assert down.converged
    found = {key: value[..., 0] for key, value in columns_of(by, slice(0, 1)).items()}
    assert_alike(found, difference(up, down, 2 * step))


@pytest.mark.parametrize("material", MATERIALS)
def test_the_modulus_is_that_of_the_whole_tissue(material: str) -> None:
    """Dents included: the slope between tissues of scenes that differ in nothing else."""

    def lifted(young_modulus_pa: float) -> tuple[TissueModel, TissueState]:
        parts = {"gravity_m_s2": 0.0, "young_modulus_pa": young_modulus_pa}
        other = scene().model_copy(update={"tissue": scene().tissue.model_copy(update=parts)})
        tissue = TissueModel(other, elements_xyz=(5, 5, 1), material=material, residual_share=1e-10)
        for arm, tip in TIPS.items():
            tissue.grasp(arm, tip)
        return tissue, tissue.solve(RAISED)

    step = 1e-4
    by = lifted(YOUNG_PA)[0].sensitivities([YOUNG_MODULUS_SCALE])
    up, down = (lifted((1 + sign * step) * YOUNG_PA)[1] for sign in (1, -1))
    found = {key: value[..., 0] for key, value in columns_of(by, slice(0, 1)).items()}
    assert_alike(found, difference(up, down, 2 * step))


@pytest.mark.parametrize("arm", TIPS)
def test_derivatives_by_the_tip_are_what_the_arm_feels(tissue: TissueModel, arm: str) -> None:
    tissue.solve(RAISED)
    tip = TipMotion(arm)
    by = tissue.sensitivities([YOUNG_MODULUS_SCALE, tip])
    for axis in range(6):
        step = 1e-6 if axis < 3 else 1e-5
        ends = []
        for sign in (1, -1):
            motion = np.zeros(6)
            motion[axis] = sign * step
            ends.append(tissue.solve({**RAISED, arm: RAISED[arm].moved(motion[:3], motion[3:])}))
        column = by.columns[tip].start + axis
        found = {
            key: value[..., 0] for key, value in columns_of(by, slice(column, column + 1)).items()
        }
        assert_alike(found, difference(*ends, 2 * step))


def test_a_free_hole_is_differentiated_from_where_it_would_begin_to_hold(
    tissue: TissueModel,
) -> None:
    """A stiffness cannot fall below zero: the difference is one-sided, its error of first order."""
    tissue.solve(RAISED)
    by = tissue.sensitivities([HoleStiffness(FREE_HOLE)])
    start = tissue.solve(RAISED)
    changed = with_hole(FREE_HOLE)(tissue, 1e-3)
    slope = (changed.nodes_m - start.nodes_m) / 1e-3
    error = np.linalg.norm(by.nodes_by[:, :, 0] - slope)
    assert error < 2e-3 * np.linalg.norm(slope)


def test_the_felt_stiffness_is_symmetric(tissue: TissueModel) -> None:
    """Forces derive from an energy: what one arm's motion does to the other works both ways."""
    tissue.solve(RAISED)
    first, second = TipMotion("psm1"), TipMotion("psm2")
    by = tissue.sensitivities([first, second])
    across = by.grasp_forces_by["psm1"][:, by.columns[second]][:, :3]
    back = by.grasp_forces_by["psm2"][:, by.columns[first]][:, :3]
    np.testing.assert_allclose(across, back.T, atol=1e-6 * np.abs(across).max())
    own = by.grasp_forces_by["psm1"][:, by.columns[first]][:, :3]
    np.testing.assert_allclose(own, own.T, atol=1e-6 * np.abs(own).max())
    assert np.all(np.linalg.eigvalsh(own) > 0)


def test_forces_stay_in_balance(tissue: TissueModel) -> None:
    tissue.solve(RAISED)
    parameters = [parameter for parameter, _, _ in CASES.values()]
    by = tissue.sensitivities([*parameters, TipMotion("psm1")])
    weight_by = np.zeros_like(by.bed_force_by)
    load = tissue.terms["gravity"]
    weight_by[:, by.columns[GRAVITY_M_S2]] = load.forces_n.sum(axis=0)[:, None]
    outside = by.attachment_forces_by.sum(axis=0) + by.bed_force_by + weight_by
    total = outside + sum(by.grasp_forces_by.values())
    scale = np.abs(outside).max(axis=0) + np.abs(by.grasp_forces_by["psm1"]).max(axis=0)
    np.testing.assert_allclose(total / scale, 0.0, atol=1e-7)


def test_misuse_is_told(tissue: TissueModel) -> None:
    tissue.solve(RAISED)
    with pytest.raises(ValueError, match="no term 'wind'; terms: material"):
        tissue.sensitivities([TermParameter("wind", "speed")])
    with pytest.raises(ValueError, match="'bed' has no parameter 'softness'; it has: height_m"):
        tissue.sensitivities([TermParameter("bed", "softness")])
    with pytest.raises(ValueError, match="holes are 0 to 143"):
        tissue.sensitivities([HoleStiffness(144)])
    with pytest.raises(ValueError, match="psm3 holds no tissue"):
        tissue.sensitivities([TipMotion("psm3")])
    with pytest.raises(ValueError, match="twice"):
        tissue.sensitivities([GRAVITY_M_S2, GRAVITY_M_S2])
    load = tissue.terms["gravity"]
    tissue.set_term(replace(load, strength=8.0))
    with pytest.raises(ValueError, match="call solve first"):
        tissue.sensitivities([GRAVITY_M_S2])
    tissue.set_term(load)
