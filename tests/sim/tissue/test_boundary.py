import numpy as np
import pytest

from defras_sim.scene import Tissue
from defras_sim.tissue.boundary import boundary_of
from defras_sim.tissue.mesh import slab_mesh

ELEMENTS = ["hexahedron20", "tetrahedron4"]


@pytest.mark.parametrize("element", ELEMENTS)
def test_areas_add_up_to_the_box(element):
    tissue = Tissue()
    boundary = boundary_of(slab_mesh(tissue, element, (3, 4, 2)))
    x, y, z = tissue.length_x_m, tissue.width_y_m, tissue.thickness_m
    assert boundary.areas_m2.sum() == pytest.approx(2 * (x * y + y * z + z * x))
    assert np.all(boundary.areas_m2 > 0)


@pytest.mark.parametrize("element", ELEMENTS)
def test_points_lie_on_the_surface_and_integrate_moments(element):
    """The divergence theorem without normals: first moments of the area of a box are its centre."""
    mesh = slab_mesh(Tissue(), element, (3, 2, 1))
    boundary = boundary_of(mesh)
    points = np.einsum("fqa,fai->fqi", boundary.values, mesh.nodes_m[boundary.faces])
    low, high = mesh.nodes_m.min(axis=0), mesh.nodes_m.max(axis=0)
    away = np.minimum(np.abs(points - low), np.abs(points - high)).min(axis=-1)
    np.testing.assert_allclose(away, 0, atol=1e-12)
    np.testing.assert_allclose(boundary.values.sum(axis=2), 1)
    centre = np.einsum("fq,fqi->i", boundary.areas_m2, points) / boundary.areas_m2.sum()
    np.testing.assert_allclose(centre, (low + high) / 2, atol=1e-12)


def test_every_node_of_a_face_is_a_point_of_its_rule():
    mesh = slab_mesh(Tissue(), "hexahedron20", (2, 2, 1))
    boundary = boundary_of(mesh)
    assert np.all(boundary.values.max(axis=1) == pytest.approx(1.0))
    low, high = mesh.nodes_m.min(axis=0), mesh.nodes_m.max(axis=0)
    outside = np.any((mesh.nodes_m == low) | (mesh.nodes_m == high), axis=1)
    np.testing.assert_array_equal(np.unique(boundary.faces), np.flatnonzero(outside))
