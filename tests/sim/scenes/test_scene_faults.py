"""Every fault of a scene file is told as file:line:column with what would be valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from defras_sim.scene import load_scene
from defras_sim.yaml_source import InvalidFile

MAP = "".join(f'    - "{"#" * 12}"\n' for _ in range(12))
GOOD = f"""name: good
roi:
  center_x_m: 0.0
  center_y_m: 0.0
attachments:
  map:
{MAP}"""


def told(folder: Path, text: str | bytes) -> str:
    """What the loader says about a file with this content."""
    file = folder / "scene.yaml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InvalidFile) as caught:
        load_scene(file)
    for fault in caught.value.faults:
        assert str(fault).startswith(f"{fault.file}:{fault.line}:{fault.column}: ")
    return str(caught.value).replace(str(folder) + "/", "")


def test_the_good_file_is_good(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(GOOD)
    assert load_scene(file).attached.all()


@pytest.mark.parametrize(
    ("changed", "line_and_column", "words"),
    [
        (GOOD + "colour: red\n", "19:1", ("colour: unknown key", "valid: name")),
        (
            GOOD.replace("center_x_m: 0.0", "center_x_mm: 0.0"),
            "3:3",
            ("unknown key", "did you mean center_x_m?"),
        ),
        (GOOD.replace("center_x_m: 0.0", "center_x_m: left"), "3:3", ("valid number", "'left'")),
        (GOOD.replace("center_x_m: 0.0", "center_x_m: 3 mm"), "3:3", ("valid number", "'3 mm'")),
        (GOOD.replace("center_x_m: 0.0", "center_x_m: .nan"), "3:3", ("finite",)),
        (
            GOOD.replace("center_x_m: 0.0", "center_x_m: 0.05"),
            "3:3",
            ("outside the tissue", "0.045"),
        ),
        (GOOD.replace("roi:", "region:"), "2:1", ("region: unknown key",)),
        (
            GOOD + "tissue:\n  bed: false\n  gravity_m_s2: 9.81\n",
            "21:3",
            ("without a bed", "(bed: true)"),
        ),
        (
            GOOD + "tissue:\n  young_modulus_pa: 100\n  gravity_m_s2: 9.81\n",
            "20:3",
            ("too soft to carry its own weight", "at least 245"),
        ),
        (GOOD.replace("#", "."), "6:3", ("no hole holds", "mark at least one with #")),
        (GOOD.replace(MAP, MAP[21:]), "6:3", ("11 rows", "needs 12")),
        (GOOD.replace("############", "####", 1), "7:7", ("'####'", "12 characters")),
        (GOOD.replace("############", "#####x######", 1), "7:7", ("each # or .",)),
        (GOOD.replace("name: good", "name: good\nname: again"), "2:1", ("duplicate key",)),
        (GOOD.replace("roi:", "roi: ["), "", ("not valid YAML",)),
        (GOOD + "tissue:\n  poisson_ratio: 0.5\n", "20:3", ("less than 0.5",)),
        (GOOD + "tissue:\n  young_modulus_pa: -1\n", "20:3", ("greater than 0",)),
        (GOOD + "tissue:\n  element: brick\n", "20:3", ("hexahedron20", "tetrahedron4")),
        (GOOD + "thresholds:\n  delta_m: [0.002, 0.001, 0.003]\n", "20:3", ("increase",)),
        (GOOD + "tick_s: 50\n", "19:1", ("less than or equal to 0.5",)),
        (GOOD + "motion:\n  pull_height_m: 40\n", "20:3", ("less than or equal to 0.1",)),
        (GOOD + "tissue:\n  length_x_m: 120\n", "20:3", ("less than or equal to 0.5",)),
        (GOOD.replace("center_y_m: 0.0", "center_y_m: 0.0\n  radius_m: 1e-5"), "5:3", ("0.001",)),
        (
            GOOD + "arms:\n  psm1: {rcm_m: [0, 90, 200], home_tip_m: [0, 0, 0], side: +y}\n",
            "20:21",
            ("less than or equal to 5",),
        ),
        (
            GOOD.replace("  map:", "  hole_pitch_m: 0.002\n  map:"),
            "6:3",
            ("60 x 60 holes", "at least 0.0024"),
        ),
        (GOOD + "grasp:\n  margin_m: 0.06\n", "20:3", ("no room", "at most 0.0550")),
        (GOOD + "depth_camera:\n  noise: 1\n", "20:3", ("did you mean noise_sd_m?",)),
        (GOOD + "arms:\n  psm3: {}\n", "20:3", ("psm1", "psm2")),
        (GOOD + "arms: {}\n", "19:1", ("at least one arm", "psm1, psm2")),
        (
            GOOD + "endoscope:\n  position_m: [0, 0, 0.2]\n  target_m: [0, 0, 0]\n",
            "20:3",
            ("down",),
        ),
        (
            GOOD + "endoscope:\n  position_m: [.nan, 0, 0.2]\n  target_m: [0, 0, 0]\n",
            "20:16",
            ("finite",),
        ),
        (GOOD + "depth_camera:\n  noise_sd_m: .inf\n", "20:3", ("finite",)),
        (GOOD + "attachments.hole_pitch_m: 0.2\n", "19:1", ("unknown key",)),
        (GOOD.replace("  map:", "  hole_pitch_m: 0.2\n  map:"), "6:3", ("hole_pitch_m", "0.12")),
        (GOOD + "tissue:\n  elements_xyz: [8, 0, 1]\n", "20:3", ("1 or more",)),
        (GOOD + "simulation:\n  elements_xyz: [8, 0, 1]\n", "20:3", ("1 or more",)),
        (GOOD + "tissue:\n  elements_xyz: [8, 8000, 1]\n", "20:3", ("at most 64",)),
        (
            GOOD + "model:\n  effects:\n    - {effect: magic}\n",
            "21:8",
            ("no effect 'magic'", "valid: anisotropy"),
        ),
        ("", "1:1", ("mapping",)),
        ("- a\n- b\n", "1:1", ("mapping",)),
    ],
)
def test_fault_is_told_where_it_stands(
    tmp_path: Path, changed: str, line_and_column: str, words: tuple[str, ...]
) -> None:
    message = told(tmp_path, changed)
    assert f"scene.yaml:{line_and_column}" in message
    for word in words:
        assert word in message


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("center_x_m: 0.0", "center_x_m: left") + "colour: red\n"
    assert len(told(tmp_path, text).splitlines()) == 2


def test_missing_parts_are_named(tmp_path: Path) -> None:
    message = told(tmp_path, "name: empty\n")
    assert "attachments" in message
    assert "roi" in message


def test_a_file_that_is_not_utf8_cannot_be_read(tmp_path: Path) -> None:
    assert "scene.yaml:1:1: cannot be read" in told(tmp_path, b"name: \xff\xfe\n")


def test_an_unreadable_file_is_told_as_such(tmp_path: Path) -> None:
    for file in (tmp_path / "absent.yaml", tmp_path):
        with pytest.raises(InvalidFile, match="cannot be read"):
            load_scene(file)


def test_extends_lays_over_and_faults_name_the_file_they_stand_in(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text(GOOD)
    (tmp_path / "scene.yaml").write_text(
        "extends: base.yaml\nname: top\nroi:\n  center_x_m: 0.01\n"
    )
    scene = load_scene(tmp_path / "scene.yaml")
    assert (scene.name, scene.roi.center_x_m, scene.roi.center_y_m) == ("top", 0.01, 0.0)
    (tmp_path / "base.yaml").write_text(GOOD.replace("center_y_m: 0.0", "center_y_m: up"))
    message = told(tmp_path, "extends: base.yaml\nname: top\nspeed: 3\n")
    assert "base.yaml:4:3" in message
    assert "scene.yaml:3:1" in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("extends: scene.yaml\n", "extends itself"),
        ("extends: absent.yaml\n", "no scene file absent.yaml"),
        ("extends: 3\n", "should name a scene file"),
        ("extends: other.yaml\n", "extends itself"),
    ],
)
def test_extends_faults(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "other.yaml").write_text("extends: scene.yaml\n")
    assert words in told(tmp_path, text)
