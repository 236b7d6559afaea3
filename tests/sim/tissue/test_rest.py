"""Tissue with weight: how it lies, hangs, and comes back when it is let go."""

import numpy as np
import pytest

from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, ElementName, Roi, Scene, Tissue
from defras_sim.tissue.model import TissueModel

DENSITY, G, HEIGHT_M = 1000.0, 9.81, 0.005
TIP = Pose(np.array([0.04, 0.01, 0.0]))


def heavy(**tissue: object) -> TissueModel:
    scene = Scene(
        name="heavy",
        attachments=Attachments(map=("##..........",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(**{"gravity_m_s2": G, **tissue}),
    )
    return TissueModel(scene, elements_xyz=(6, 6, 1))


def raised(tissue: TissueModel, lift_m: float, back_m: float = 0.0) -> None:
    tissue.grasp("psm1", TIP)
    tissue.solve({"psm1": TIP.moved(np.array([0.0, 0.0, lift_m]))})
    assert tissue.solve({"psm1": TIP.moved(np.array([-back_m, 0.0, lift_m]))}).converged


def test_lying_tissue_is_thinned_by_its_weight_as_a_free_column() -> None:
    """Stress rising to rho g h over the height: thinner by rho g h^2 / 2 E, apart from the rim."""
    surface = heavy().solve({}).surface
    inner = np.abs(surface.rest_xy_m).max(axis=1) < 0.03
    height_m = surface.vertices_m[:, 2]
    thinned = HEIGHT_M - height_m[inner & surface.upper] + height_m[inner & ~surface.upper]
    expected = DENSITY * G * HEIGHT_M**2 / (2 * Tissue().young_modulus_pa)
    assert thinned.mean() == pytest.approx(expected, rel=0.04)
    np.testing.assert_allclose(thinned, expected, rtol=0.2)


def test_attachments_do_not_pull_at_tissue_that_lies_as_it_lay_when_they_grew() -> None:
    state = heavy().solve({})
    weight = DENSITY * G * 0.12 * 0.12 * HEIGHT_M
    np.testing.assert_allclose(state.attachment_forces_n, 0.0, atol=1e-5 * weight)
    np.testing.assert_allclose(state.bed_force_n, [0, 0, weight], atol=1e-4 * weight)


def test_without_a_bed_it_hangs_on_its_attachments() -> None:
    tissue = heavy(bed=False)
    state = tissue.solve({})
    assert state.converged
    assert state.nodes_m[:, 2].min() < -0.08
    weight = DENSITY * G * 0.12 * 0.12 * HEIGHT_M
    np.testing.assert_allclose(state.attachment_forces_n.sum(axis=0), [0, 0, weight], atol=1e-5)
    np.testing.assert_array_equal(state.nodes_m, tissue.rest_m)


def test_grasping_it_as_it_lies_takes_no_force() -> None:
    tissue = heavy()
    tissue.grasp("psm1", TIP)
    state = tissue.solve({"psm1": TIP})
    np.testing.assert_allclose(state.grasp_forces_n["psm1"], 0.0, atol=1e-5)


@pytest.mark.parametrize("bed", [True, False])
def test_reset_brings_it_to_rest(bed: bool) -> None:
    tissue = heavy(bed=bed)
    rest = tissue.solve({}).nodes_m
    tip = Pose(rest[np.argmax(rest[:, 2] + 0.1 * rest[:, 0])])
    tissue.grasp("psm1", tip)
    tissue.solve({"psm1": tip.moved(np.array([0.0, 0.0, 0.02]))})
    tissue.reset()
    np.testing.assert_allclose(tissue.solve({}).nodes_m, rest, atol=1e-5)


def test_let_go_it_settles_on_its_bed_again() -> None:
    tissue = heavy()
    rest = tissue.rest_m
    raised(tissue, 0.03, 0.02)
    tissue.release("psm1")
    state = tissue.solve({})
    assert state.converged
    np.testing.assert_allclose(state.nodes_m, rest, atol=2e-5)


def test_a_second_grasp_knows_where_the_tissue_rests() -> None:
    tissue = heavy()
    raised(tissue, 0.03)
    grasp = tissue.snapshot().grasps["psm1"]
    tip = grasp.unloaded_tip(tissue.rest_m)
    np.testing.assert_allclose(tip.position_m, TIP.position_m, atol=3e-6)
    np.testing.assert_allclose(tip.rotation, np.eye(3), atol=1e-4)


def test_heavier_tissue_takes_more_force_to_lift() -> None:
    forces = []
    for g in (0.0, 3.0, G):
        tissue = heavy(gravity_m_s2=g)
        tissue.grasp("psm1", TIP)
        state = tissue.solve({"psm1": TIP.moved(np.array([0.0, 0.0, 0.02]))})
        forces.append(state.grasp_forces_n["psm1"][2])
    assert forces[0] < 0.5 * forces[1] < 0.5 * forces[2]


def test_without_weight_rest_is_the_mesh_itself() -> None:
    tissue = heavy(gravity_m_s2=0.0)
    np.testing.assert_array_equal(tissue.rest_m, tissue.mesh.nodes_m)
    raised(tissue, 0.02)
    tissue.release("psm1")
    np.testing.assert_array_equal(tissue.solve({}).nodes_m, tissue.mesh.nodes_m)


@pytest.mark.parametrize("element", ["hexahedron20", "tetrahedron10"])
def test_without_weight_it_stays_where_it_is_though_nothing_holds_it(element: ElementName) -> None:
    tissue = heavy(gravity_m_s2=0.0, element=element)
    tissue.set_hole_stiffness(np.zeros_like(tissue.hole_stiffness_n_per_m))
    state = tissue.solve({})
    assert state.converged
    assert state.iterations == 0
    np.testing.assert_array_equal(state.nodes_m, tissue.mesh.nodes_m)


def test_the_softest_tissue_that_a_scene_may_have_finds_its_place() -> None:
    """Scenes refuse softer ones: see the fault of tissue.young_modulus_pa."""
    state = heavy(young_modulus_pa=DENSITY * G * HEIGHT_M / 0.2).solve({})
    assert state.converged
    upper = state.surface.vertices_m[state.surface.upper]
    assert -0.3 * HEIGHT_M < upper[:, 2].min() < upper[:, 2].max() < -0.05 * HEIGHT_M


def test_tissue_that_cannot_carry_its_weight_is_told() -> None:
    with pytest.raises(ValueError, match="finds no place to lie"):
        heavy(young_modulus_pa=1.0)
