"""What meshes miss of a disc's dent: it makes coarse meshes agree, and vanishes on fine ones."""

from pathlib import Path

import numpy as np
import pytest

from defras_sim.anatomy.anatomy import Anatomy, VolumeMesh
from defras_sim.geometry import Pose
from defras_sim.resources import resource
from defras_sim.scene import Attachments, Roi, Scene, Tissue, load_scene
from defras_sim.tissue.mesh import slab_mesh, tetrahedral_slab
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.tetrahedra import FACES
from defras_sim.tissue.tissue_mesh import tissue_mesh
from defras_sim.tissue.unresolved import DentsOf

INSIDE = np.array([[-0.005, -0.005]])


def dents(cells, tissue=None, element="hexahedron20", material="neo_hookean"):
    tissue = tissue or Tissue()
    return DentsOf(slab_mesh(tissue, element, cells), tissue, material)


def test_the_finer_the_mesh_the_less_is_missing():
    missing = [
        dents(cells).at(INSIDE, 0.003, upper=False).give_m_per_n[0]
        for cells in ((6, 6, 1), (12, 12, 1), (16, 16, 2), (24, 24, 2))
    ]
    assert np.all(np.diff(missing) < 0)
    assert missing[-1] < 0.25 * missing[0]


def test_softer_tissue_gives_way_further_in_proportion():
    plain = dents((8, 8, 1)).at(INSIDE, 0.003, upper=False)
    soft = dents((8, 8, 1), Tissue(young_modulus_pa=1500.0)).at(INSIDE, 0.003, upper=False)
    np.testing.assert_allclose(soft.give_m_per_n, 2 * plain.give_m_per_n)
    np.testing.assert_allclose(soft.hardening_n, plain.hardening_n / 2)


def test_mirror_images_and_exchanged_axes_are_alike():
    places = np.array([[-0.055, 0.005], [0.055, -0.005], [0.005, -0.055]])
    give = dents((12, 12, 1)).at(places, 0.003, upper=False).give_m_per_n.reshape(3, 3)
    np.testing.assert_allclose(give[0], give[1])
    # With the axes, the moments along them change places.
    np.testing.assert_allclose(give[0], give[2][[0, 2, 1]], rtol=1e-6)


def test_linear_tetrahedra_keep_their_faults():
    found = dents((12, 12, 1), element="tetrahedron4").at(INSIDE, 0.003, upper=False)
    assert not found.give_m_per_n.any()


@pytest.mark.parametrize("material", ["neo_hookean", "corotational"])
def test_the_first_millimetres_of_a_lift_do_not_depend_on_the_mesh(material):
    """5x7x1, 8x8x1 and 12x12x1 elements agree with 16x16x2; without dents they are far off."""
    scene = Scene(
        name="two edges",
        attachments=Attachments(map=("#..........#",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        tissue=Tissue(bed=False),
    )
    start = Pose(np.array([0.025, 0.025, 0.0]))
    forces = []
    for cells in ((16, 16, 2), (5, 7, 1), (8, 8, 1), (12, 12, 1)):
        tissue = TissueModel(scene, elements_xyz=cells, material=material)
        tissue.grasp("psm1", start)
        state = tissue.solve({"psm1": start.moved(np.array([0.0, 0.0, 0.004]))})
        assert state.converged
        forces.append(np.linalg.norm(state.grasp_forces_n["psm1"]))
    np.testing.assert_allclose(forces[1], forces[0], rtol=0.25)
    np.testing.assert_allclose(forces[2:], forces[0], rtol=0.05)


def test_quadratic_tetrahedra_read_the_force_that_hexahedra_do():
    """Without dents of their own, a lift of 10 mm takes 60 % more force on 8x8x1 of their cells."""
    scene = load_scene(resource("sim/scenes/demo.yaml"))
    start = Pose(np.array([0.01, 0.02, 0.0]))
    forces = {}
    for element in ("hexahedron20", "tetrahedron10"):
        tissue = TissueModel(scene, element=element, elements_xyz=(8, 8, 1))
        tissue.grasp("psm1", start)
        for lift_m in (0.01, 0.02, 0.03):
            state = tissue.solve({"psm1": start.moved(np.array([0.0, 0.0, lift_m]))})
            assert state.converged
            forces[element, lift_m] = np.linalg.norm(state.grasp_forces_n["psm1"])
    for lift_m in (0.01, 0.02, 0.03):
        expected = pytest.approx(forces["hexahedron20", lift_m], rel=0.1)
        assert forces["tetrahedron10", lift_m] == expected


def slab_as_anatomy(tissue: Tissue, cells: tuple[int, int, int]) -> Tissue:
    """The slab given as a patient's anatomy, by its surface and by tetrahedra."""
    mesh = VolumeMesh(*tetrahedral_slab(tissue, cells))
    sides = mesh.tetrahedra[:, FACES].reshape(-1, 3)
    triangles = sides[np.unique(np.sort(sides, axis=1), axis=0, return_index=True)[1]]
    height = mesh.nodes_m[triangles, 2]
    upper = (height == 0.0).all(axis=1)
    lower = (height == -tissue.thickness_m).all(axis=1)
    on_face = upper | lower
    anatomy = Anatomy(
        mesh.nodes_m,
        triangles[on_face],
        np.where(upper, 1, -1)[on_face],
        {"twin": mesh, "actual": mesh},
        Path("slab.npz"),
        f"slab of {cells}",
    )
    return tissue.model_copy(update={"anatomy": anatomy, "element": "tetrahedron10"})


def test_an_anatomy_has_the_dents_of_the_slab_that_it_is():
    """Inside; at an edge, whose distance is rounded; at a corner less: one edge is seen."""
    tissue, cells = Tissue(), (8, 8, 1)
    places = np.array([[0.005, 0.015], [0.055, 0.005], [-0.055, 0.055]])
    slab = dents(cells, element="tetrahedron10").at(places, 0.003, upper=False)
    patient = slab_as_anatomy(tissue, cells)
    found = DentsOf(tissue_mesh(patient, "tetrahedron10", cells), patient, "neo_hookean").at(
        places, 0.003, upper=False
    )
    expected, give = (each.give_m_per_n.reshape(3, 3) for each in (slab, found))
    np.testing.assert_allclose(give[0], expected[0], rtol=0.02)
    np.testing.assert_allclose(give[1, 0], expected[1, 0], rtol=0.2)
    assert 0.0 < give[2, 0] <= expected[2, 0]


def test_discs_that_reach_over_the_rim_of_an_anatomy_have_dents():
    """Squeezed onto what tissue there is, they pull a little of it: it gives way further."""
    patient = slab_as_anatomy(Tissue(), (8, 8, 1))
    places = np.array([[0.0595 - inside_m, 0.005] for inside_m in (0.008, 0.002, 0.0005)])
    found = DentsOf(tissue_mesh(patient, "tetrahedron10", (8, 8, 1)), patient, "neo_hookean").at(
        places, 0.003, upper=False
    )
    assert np.all(np.diff(found.give_m_per_n.reshape(3, 3)[:, 0]) > 0.0)


def test_the_force_of_an_anatomy_is_that_of_the_slab_that_it_is():
    """Without dents of its own it takes 60 % more on 8x8x1 cells."""
    scene = load_scene(resource("sim/scenes/demo.yaml"))
    tissue = slab_as_anatomy(scene.tissue, (8, 8, 1))
    start = Pose(np.array([0.01, 0.02, 0.0]))
    forces = []
    for same in (scene, scene.model_copy(update={"tissue": tissue})):
        model = TissueModel(same, elements_xyz=(8, 8, 1))
        model.grasp("psm1", start)
        for lift_m in (0.005, 0.01):
            state = model.solve({"psm1": start.moved(np.array([0.0, 0.0, lift_m]))})
            assert state.converged
        forces.append(np.linalg.norm(state.grasp_forces_n["psm1"]))
    assert forces[1] == pytest.approx(forces[0], rel=0.12)
