import numpy as np
import pytest

from defras_sim.scene import Tissue
from defras_sim.tissue.mesh import slab_mesh, tetrahedral_slab

ELEMENTS = ["hexahedron20", "tetrahedron10", "tetrahedron4"]


def points_in(tissue: Tissue, count: int = 200) -> np.ndarray:
    unit = np.random.default_rng(0).uniform(0, 1, (count, 3))
    size = np.array([tissue.length_x_m, tissue.width_y_m, tissue.thickness_m])
    return (unit - [0.5, 0.5, 1.0]) * size


@pytest.mark.parametrize("element", ELEMENTS)
def test_interpolation_reproduces_linear_fields_everywhere(element):
    mesh = slab_mesh(Tissue(), element, (5, 4, 2))
    points = points_in(Tissue())
    np.testing.assert_allclose(mesh.interpolation(points) @ mesh.nodes_m, points, atol=1e-14)


@pytest.mark.parametrize("element", ELEMENTS)
def test_interpolation_at_the_nodes_is_the_identity(element):
    mesh = slab_mesh(Tissue(), element, (3, 2, 1))
    matrix = mesh.interpolation(mesh.nodes_m).toarray()
    np.testing.assert_allclose(matrix, np.eye(len(mesh.nodes_m)), atol=1e-9)


def test_a_point_outside_the_slab_is_refused():
    mesh = slab_mesh(Tissue(), "hexahedron20", (3, 2, 1))
    with pytest.raises(ValueError, match="outside the slab"):
        mesh.interpolation(np.array([[0.07, 0.0, 0.0]]))


def test_node_counts_of_the_two_meshes():
    assert len(slab_mesh(Tissue(), "hexahedron20", (8, 8, 1)).nodes_m) == 531
    assert len(slab_mesh(Tissue(), "tetrahedron4", (12, 12, 1)).nodes_m) == 338


def test_tetrahedra_are_positive_and_fill_the_slab():
    tissue = Tissue()
    nodes, tets = tetrahedral_slab(tissue, (4, 3, 2))
    corners = nodes[tets]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(0.12 * 0.12 * 0.005)


def test_tetrahedra_share_whole_faces():
    _, tets = tetrahedral_slab(Tissue(), (3, 3, 2))
    faces = np.sort(
        np.concatenate(
            [tets[:, [0, 1, 2]], tets[:, [0, 1, 3]], tets[:, [0, 2, 3]], tets[:, [1, 2, 3]]]
        ),
        axis=1,
    )
    _, counts = np.unique(faces, axis=0, return_counts=True)
    assert counts.max() == 2
    # Two triangles a cell face: 3x3 above and below, 4 sides of 3x2.
    assert np.sum(counts == 1) == 2 * (2 * 9 + 4 * 6)
