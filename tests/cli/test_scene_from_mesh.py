"""``defras scene from-mesh``: what it makes, and what it says where it makes nothing."""

from __future__ import annotations

import pytest
import trimesh

from tests.sim.anatomy.organs import lumpy_body, lumpy_sheet


@pytest.fixture(scope="module")
def sheet_file(tmp_path_factory):
    file = tmp_path_factory.mktemp("organs") / "flap.stl"
    lumpy_sheet().apply_scale(1000).export(file)
    return file


def test_a_sheet_becomes_a_scene_that_can_be_checked_and_drawn(defras, sheet_file, tmp_path):
    out = tmp_path / "scenes" / "patient.yaml"
    out.parent.mkdir()
    code, said, _ = defras(
        "scene", "from-mesh", str(sheet_file), "--unit", "mm", "--thickness", "5mm", "-o", str(out)
    )
    assert code == 0
    assert "Mended: merged" in said
    assert "holes hold along the far edge" in said
    assert "Mesh of the twin tissue" in said
    assert sorted(path.name for path in out.parent.iterdir()) == ["patient.npz", "patient.yaml"]
    code, said, _ = defras("scene", "check", str(out))
    assert code == 0
    assert "patient is valid" in said
    picture = tmp_path / "patient.png"
    assert defras("scene", "show", str(out), "-o", str(picture))[0] == 0
    assert picture.stat().st_size > 50_000
    code, _, error = defras("run", str(out), "--world", "bullet")
    assert code == 2
    assert "slabs only" in error


def test_a_folder_that_is_not_there_is_named_and_not_made(defras, sheet_file, tmp_path):
    out = tmp_path / "scenes" / "of_today" / "patient.yaml"
    code, _, error = defras(
        "scene", "from-mesh", str(sheet_file), "--unit", "mm", "--thickness", "5mm", "-o", str(out)
    )
    assert code == 2
    assert f"there is no folder {tmp_path / 'scenes'}; make it first" in error.replace("\n", "")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--unit", "mm"), "--thickness 5mm"),
        (("--unit", "mm", "--thickness", "5"), "with its unit"),
        (("--unit", "mm", "--thickness", "5m"), "0.5mm to 30mm"),
        (("--unit", "m", "--thickness", "5mm"), "say --unit mm"),
        (("--unit", "inch", "--thickness", "5mm"), "'inch' is not one of"),
        (("--thickness", "5mm"), "Missing option '--unit'"),
        (("--unit", "mm", "--thickness", "5mm", "--up", "x"), "--up"),
        (("--unit", "mm", "--thickness", "5mm", "-o", "scene.stl"), "give the name of a file"),
    ],
)
def test_what_is_missing_or_wrong_is_said(
    defras, sheet_file, arguments, words, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    code, _, error = defras("scene", "from-mesh", str(sheet_file), *arguments)
    assert code == 2
    assert words in error
    assert not list(tmp_path.iterdir())


def test_two_bodies_are_refused_with_the_name_of_the_file(defras, tmp_path):
    both = trimesh.util.concatenate([lumpy_body(), lumpy_body().apply_translation([0.15, 0, 0])])
    both.export(tmp_path / "pair.ply")
    out = tmp_path / "pair.yaml"
    code, _, error = defras(
        "scene", "from-mesh", str(tmp_path / "pair.ply"), "--unit", "m", "-o", str(out)
    )
    assert code == 2
    assert "pair.ply: the surface has 2 separate bodies" in error
    assert not out.exists()


def test_a_file_that_is_no_surface_is_named_once(defras, tmp_path):
    file = tmp_path / "points.xyz"
    file.write_text("0 0 0")
    code, _, error = defras("scene", "from-mesh", str(file), "--unit", "m")
    assert code == 2
    assert error.count("points.xyz") == 1
