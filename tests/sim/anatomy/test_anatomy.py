import numpy as np
import pytest

from defras_sim.anatomy.anatomy import Anatomy, read_anatomy
from defras_sim.anatomy.building import boundary
from defras_sim.anatomy.sides import sides


def test_what_was_written_is_read_again(flap: Anatomy):
    again = read_anatomy(flap.file)
    assert again == flap
    assert hash(again) == hash(flap)
    np.testing.assert_array_equal(again.vertices_m, flap.vertices_m)
    np.testing.assert_array_equal(
        again.meshes["actual"].tetrahedra, flap.meshes["actual"].tetrahedra
    )
    assert again.taking("actual") != flap
    assert again.taking("actual").volume_mesh is again.meshes["actual"]


def test_the_surface_is_closed_and_stands_over_the_origin(flap: Anatomy):
    edges = np.sort(flap.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)
    np.testing.assert_allclose((flap.low_m + flap.high_m)[:2], 0.0, atol=1e-12)
    np.testing.assert_array_equal(sides(flap.vertices_m, flap.triangles), flap.side)


def test_its_vertices_are_nodes_of_the_mesh_that_imitates_reality(flap: Anatomy):
    points, _ = boundary(flap.meshes["actual"])
    np.testing.assert_allclose(flap.vertices_m, points, atol=1e-15)


def test_the_meshes_differ(flap: Anatomy):
    twin, actual = flap.meshes["twin"], flap.meshes["actual"]
    assert len(actual.tetrahedra) > 1.3 * len(twin.tetrahedra)


def test_faces_have_the_flap_between_them(flap: Anatomy):
    places = np.random.default_rng(0).uniform(-0.035, 0.035, (50, 2))
    upper, lower = flap.upper.at(places), flap.lower.at(places)
    slope = np.cross(*np.moveaxis(flap.upper.tangents(places), 1, 0))[:, 2]
    np.testing.assert_allclose((upper - lower)[:, 2] * slope, 0.005, rtol=0.12)
    assert flap.covers(places).all()
    assert np.all(flap.room_m(places) > 0)
    assert not flap.covers(places + 0.2).any()
    assert np.all(flap.room_m(places + 0.2) == 0)


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 nonsense"])
def test_files_that_are_no_anatomy_are_refused(tmp_path, content):
    file = tmp_path / "organ.npz"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"organ\.npz cannot be read"):
        read_anatomy(file)


def test_a_file_that_lacks_something_is_refused(tmp_path):
    np.savez(tmp_path / "organ.npz", surface_vertices_m=np.zeros((3, 3)))
    with pytest.raises(ValueError, match="lacks surface_triangles"):
        read_anatomy(tmp_path / "organ.npz")
