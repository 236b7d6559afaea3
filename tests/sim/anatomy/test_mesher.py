import numpy as np
import pytest
import trimesh

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.anatomy.mesher import meshed, unknowns_of
from defras_sim.anatomy.quality import qualities, require_sound, volume_m3
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.repair import sound_surface
from defras_sim.anatomy.solid import tissue_of
from defras_sim.tissue.tetrahedral_mesh import tetrahedral_mesh
from tests.sim.anatomy.organs import lumpy_body, lumpy_sheet

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


def test_a_body_is_filled_within_the_number_of_unknowns():
    body = tissue_of(sound_surface(lumpy_body()), None)
    heard: list[str] = []
    mesh = meshed(body, (1500, 6000), heard.append)
    assert 1500 <= unknowns_of(mesh) <= 6000
    assert unknowns_of(mesh) == 3 * len(tetrahedral_mesh(mesh).nodes_m)
    assert volume_m3(mesh) == pytest.approx(body.volume_m3, rel=0.03)
    assert qualities(mesh).min() > 0.1
    assert "unknowns" in heard[-1]
    # Its surface is the body's, within the share of an edge that the envelope allows.
    distance = trimesh.proximity.closest_point(
        trimesh.Trimesh(body.vertices_m, body.triangles, process=False), mesh.nodes_m
    )[1]
    inside = trimesh.Trimesh(body.vertices_m, body.triangles).contains(mesh.nodes_m)
    assert distance[~inside].max() < 0.002


@pytest.mark.parametrize("unknowns", [(2000, 2600), (3000, 4600), (5500, 8500)])
def test_a_sheet_is_filled_within_the_number_of_unknowns(unknowns):
    sheet = tissue_of(sound_surface(lumpy_sheet()), 0.005)
    least, most = unknowns
    assert least <= unknowns_of(meshed(sheet, unknowns)) <= most


def test_too_few_unknowns_for_a_shape_are_refused():
    sheet = tissue_of(sound_surface(lumpy_sheet()), 0.005)
    with pytest.raises(RefusedSurface):
        meshed(sheet, (100, 200))


def test_quality_is_one_of_a_regular_tetrahedron_and_falls_when_it_is_flat():
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    number = np.array([[0, 2, 1, 3]])
    volume = np.linalg.det(regular[number[0, 1:]] - regular[0])
    mesh = VolumeMesh(regular, number if volume > 0 else number[:, [0, 2, 1, 3]])
    np.testing.assert_allclose(qualities(mesh), 1.0)
    assert qualities(VolumeMesh(CORNERS * [1, 1, 0.01], np.array([[0, 1, 2, 3]])))[0] < 0.05


@pytest.mark.parametrize(
    ("tetrahedra", "scale", "words"),
    [
        ([[0, 2, 1, 3]], 1.0, "quality -"),
        ([[0, 1, 2, 3]], 0.01, "quality 0.0"),
        ([[0, 1, 2, 3]] * 3, 1.0, "share one face"),
        ([], 1.0, "no inside"),
    ],
)
def test_unsound_meshes_are_refused(tetrahedra, scale, words):
    mesh = VolumeMesh(CORNERS * [1, 1, scale], np.array(tetrahedra, dtype=int).reshape(-1, 4))
    with pytest.raises(RefusedSurface, match=words):
        require_sound(mesh, 1 / 6)


def test_a_mesh_of_another_volume_is_refused():
    with pytest.raises(RefusedSurface, match="details of the surface are finer"):
        require_sound(VolumeMesh(CORNERS, np.array([[0, 1, 2, 3]])), 0.2)
