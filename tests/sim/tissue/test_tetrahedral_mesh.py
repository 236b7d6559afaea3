import numpy as np
import pytest

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.scene import Tissue
from defras_sim.tissue.mesh import slab_mesh, tetrahedral_slab
from defras_sim.tissue.tetrahedral_mesh import TetrahedralMesh, tetrahedral_mesh

CELLS = (5, 4, 2)


@pytest.fixture(scope="module")
def mesh() -> TetrahedralMesh:
    return tetrahedral_mesh(VolumeMesh(*tetrahedral_slab(Tissue(), CELLS)))


def places(count: int = 200) -> np.ndarray:
    unit = np.random.default_rng(0).uniform(0, 1, (count, 3))
    return (unit - [0.5, 0.5, 1.0]) * [0.12, 0.12, 0.005]


def test_it_interpolates_as_the_slab_of_the_same_elements(mesh):
    slab = slab_mesh(Tissue(), "tetrahedron10", CELLS)
    np.testing.assert_array_equal(mesh.nodes_m, slab.nodes_m)
    found, expected = (m.interpolation(places()) for m in (mesh, slab))
    np.testing.assert_allclose(found.toarray(), expected.toarray(), atol=1e-10)


def test_quadratic_fields_are_interpolated_exactly_also_a_little_outside(mesh):
    points = places() * [1, 1, 1.1]  # down to 0.5 mm below the lowest element

    def field(x):
        return x[:, 0] ** 2 - 3 * x[:, 1] * x[:, 2] + x[:, 2] ** 2 - x[:, 0] + 0.2

    values = mesh.interpolation(points) @ field(mesh.nodes_m)
    np.testing.assert_allclose(values, field(points), atol=1e-12)


def test_a_point_far_outside_is_refused(mesh):
    with pytest.raises(ValueError, match="outside the tissue"):
        mesh.interpolation(np.array([[0.0, 0.0, 0.01]]))
