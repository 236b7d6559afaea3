import numpy as np
import pytest
import trimesh

from defras_sim.scene import Tissue
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.surface import surface_map


def surface_of(element: str, cells=(8, 8, 1)):
    mesh = slab_mesh(Tissue(), element, cells)
    return surface_map(mesh, Tissue()).surface(mesh.nodes_m)


def test_surface_is_closed_and_outward():
    surface = surface_of("hexahedron20")
    body = trimesh.Trimesh(surface.vertices_m, surface.triangles, process=False)
    assert body.is_watertight
    assert body.volume == pytest.approx(0.12 * 0.12 * 0.005)


def test_upper_vertices_lie_above_their_rest_place():
    surface = surface_of("hexahedron20")
    np.testing.assert_allclose(surface.vertices_m[surface.upper, 2], 0, atol=1e-15)
    np.testing.assert_allclose(surface.vertices_m[~surface.upper, 2], -0.005)
    np.testing.assert_allclose(surface.vertices_m[:, :2], surface.rest_xy_m, atol=1e-14)


def test_every_mesh_gives_the_same_triangles():
    one, other = surface_of("hexahedron20"), surface_of("tetrahedron4", (12, 12, 1))
    np.testing.assert_array_equal(one.triangles, other.triangles)
    np.testing.assert_allclose(one.vertices_m, other.vertices_m, atol=1e-14)


def test_triangles_follow_curved_faces():
    mesh = slab_mesh(Tissue(), "hexahedron20", (2, 2, 1))
    curved = mesh.nodes_m.copy()
    curved[:, 2] += 5.0 * curved[:, 0] ** 2
    surface = surface_map(mesh, Tissue()).surface(curved)
    x, _, z = surface.vertices_m[surface.upper].T
    np.testing.assert_allclose(z, 5.0 * x**2, atol=1e-14)
