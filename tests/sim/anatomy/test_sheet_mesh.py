import numpy as np
import pytest

from defras_sim.anatomy.quality import qualities, volume_m3
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.sheet_mesh import sheet_mesh
from defras_sim.anatomy.solid import Sheet
from defras_sim.tissue.tetrahedra import FACES
from tests.sim.anatomy.organs import disc, lumps_m, lumpy_sheet


def lumpy(thickness_m: float = 0.005) -> Sheet:
    sheet = lumpy_sheet(rings=40)
    return Sheet(np.asarray(sheet.vertices), np.asarray(sheet.faces), thickness_m)


def flat(length_m: float, width_m: float, count: int = 25) -> Sheet:
    x, y = (
        np.linspace(-length_m / 2, length_m / 2, count),
        np.linspace(-width_m / 2, width_m / 2, count),
    )
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    i, j = np.meshgrid(np.arange(count - 1), np.arange(count - 1))
    a = (j * count + i).ravel()
    squares = np.stack([a, a + 1, a + count + 1, a + count], axis=1)
    triangles = squares[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return Sheet(np.column_stack([points, np.zeros(len(points))]), triangles, 0.005)


@pytest.mark.parametrize("edge_m", [0.012, 0.008])
def test_a_flat_sheet_is_a_slab_with_its_corners(edge_m):
    mesh = sheet_mesh(flat(0.12, 0.10), edge_m)
    assert volume_m3(mesh) == pytest.approx(0.12 * 0.10 * 0.005, rel=1e-9)
    assert qualities(mesh).min() > 0.3
    np.testing.assert_allclose(np.ptp(mesh.nodes_m, axis=0), [0.12, 0.10, 0.005])


@pytest.mark.parametrize("edge_m", [0.012, 0.008])
def test_elements_of_a_lumpy_sheet_are_well_shaped_and_share_whole_faces(edge_m):
    mesh = sheet_mesh(lumpy(), edge_m)
    assert qualities(mesh).min() > 0.3
    faces = np.sort(mesh.tetrahedra[:, FACES].reshape(-1, 3), axis=1)
    _, counts = np.unique(faces, axis=0, return_counts=True)
    assert counts.max() == 2
    # Of a disc with V corners, E edges and T triangles, V - E + T = 1: closed around one solid.
    boundary = np.unique(faces, axis=0)[counts == 1]
    edges = np.unique(np.sort(boundary[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    assert len(np.unique(boundary)) - len(edges) + len(boundary) == 2


def test_the_upper_face_is_the_sheet_and_the_thickness_is_kept():
    mesh = sheet_mesh(lumpy(), 0.008)
    upper, lower = np.split(mesh.nodes_m, 2)
    np.testing.assert_allclose(upper[:, 2], lumps_m(*upper[:, :2].T), atol=2e-4)
    np.testing.assert_allclose(np.linalg.norm(upper - lower, axis=1), 0.005, rtol=1e-9)


def test_edges_become_shorter_in_proportion():
    counts = [len(sheet_mesh(lumpy(), edge_m).nodes_m) for edge_m in (0.016, 0.008)]
    assert counts[1] / counts[0] == pytest.approx(4, rel=0.25)


def test_a_sheet_that_bends_more_sharply_than_it_is_thick_is_refused():
    points, triangles = disc(40)
    x, y = (0.04 * points).T
    trough = Sheet(np.column_stack([x, y, 0.02 * np.abs(x) / 0.01]), triangles, 0.015)
    with pytest.raises(RefusedSurface, match="15 mm of tissue below it would fold into itself"):
        sheet_mesh(Sheet(trough.vertices_m * [1, 1, -1], triangles, 0.015), 0.008)
