import numpy as np
import pytest
import trimesh

from defras_sim.anatomy.reading import read_surface
from defras_sim.anatomy.refused import RefusedSurface
from tests.sim.anatomy.organs import lumpy_body


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)])
def test_every_format_and_unit_gives_the_same_surface(tmp_path, suffix, unit, metres):
    body = lumpy_body()
    file = tmp_path / f"organ.{suffix}"
    trimesh.Trimesh(body.vertices / metres, body.faces).export(file)
    read = read_surface(file, unit)
    assert len(read.faces) == len(body.faces)
    np.testing.assert_allclose(read.bounds, body.bounds, atol=1e-6)


@pytest.mark.parametrize("up", ["x", "-x", "y", "-y", "z", "-z"])
def test_the_axis_that_is_up_becomes_z_and_nothing_is_mirrored(tmp_path, up):
    body = lumpy_body()
    file = tmp_path / "organ.ply"
    body.export(file)
    read = read_surface(file, "m", up)
    axis, sign = "xyz".index(up[-1]), -1 if up[0] == "-" else 1
    np.testing.assert_allclose(read.vertices[:, 2], sign * body.vertices[:, axis], atol=1e-7)
    assert read.volume == pytest.approx(body.volume, rel=1e-5)


def refusal(file, unit="mm") -> str:
    with pytest.raises(RefusedSurface) as refused:
        read_surface(file, unit)
    return str(refused.value)


def test_what_is_no_surface_is_refused_in_words(tmp_path):
    (tmp_path / "organ.dicom").write_bytes(b"")
    assert "valid are .stl, .obj and .ply" in refusal(tmp_path / "organ.dicom")
    (tmp_path / "empty.stl").write_bytes(b"")
    assert "empty.stl" in refusal(tmp_path / "empty.stl")
    (tmp_path / "broken.ply").write_text("ply\nformat ascii 1.0\nelement vertex x\n")
    assert "cannot be read as a surface" in refusal(tmp_path / "broken.ply")
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    assert "points.obj" in refusal(tmp_path / "points.obj")


def test_vertices_that_are_no_numbers_are_told(tmp_path):
    (tmp_path / "holey.obj").write_text(
        "v 0 0 0\nv 50 0 0\nv 0 nan 0\nv 0 50 9\nf 1 2 3\nf 1 2 4\n"
    )
    assert "number 2; every coordinate should be finite" in refusal(tmp_path / "holey.obj")


def test_a_wrong_unit_is_noticed_by_the_size(tmp_path):
    lumpy_body().export(tmp_path / "organ.stl")  # in metres
    message = refusal(tmp_path / "organ.stl", "mm")
    assert "should be 20 to 400 mm" in message
    assert "say --unit m" in message
    trimesh.creation.icosphere(radius=50.0).export(tmp_path / "ball.stl")
    assert "is its unit mm?" in refusal(tmp_path / "ball.stl", "m")
