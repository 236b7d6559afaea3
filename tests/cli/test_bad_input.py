"""Whatever is wrong with the input: exit code 2, where, what, and what would be valid."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

Defras = Callable[..., tuple[int, str, str]]

GOOD = """\
name: mine
attachments:
  map:
{rows}
roi: {{center_x_m: 0.0, center_y_m: 0.0}}
"""
ROWS = ['    - "........####"'] * 12


def scene_file(folder: Path, text: str | None = None, **extra: str) -> Path:
    file = folder / "mine.yaml"
    good = GOOD.format(rows="\n".join(ROWS))
    body = good if text is None else text
    file.write_text(body + "".join(f"{key}: {value}\n" for key, value in extra.items()))
    return file


def test_a_good_scene_passes(defras: Defras, tmp_path: Path) -> None:
    code, out, _ = defras("scene", "check", str(scene_file(tmp_path)))
    assert code == 0
    assert "48 of 144 holes hold" in out


@pytest.mark.parametrize(
    ("extra", "place", "says"),
    [
        ({"tisue": "{}"}, ":17:1:", "tisue"),
        ({"tissue": "{thickness_m: 5 mm}"}, ":17:10:", "thickness_m"),
        ({"tissue": "{thickness_m: .nan}"}, ":17:10:", "thickness_m"),
        ({"tissue": "{thickness_mm: 5}"}, ":17:10:", "thickness_mm"),
        ({"motion": "{pull_height_m: -0.04}"}, ":17:10:", "greater than 0"),
        ({"grasp": "{columns: 41}"}, ":17:9:", "less than or equal to 40"),
        ({"grasp": "{margin_m: 0.058}"}, ":17:9:", "room"),
        ({"model": "{effects: [{effect: gravitty}]}"}, ":17:", "did you mean gravity"),
        ({"extends": "nowhere.yaml"}, ":17:1:", "nowhere.yaml"),
    ],
)
def test_a_fault_is_reported_at_its_place(
    defras: Defras, tmp_path: Path, extra: dict[str, str], place: str, says: str
) -> None:
    file = scene_file(tmp_path, **extra)
    code, _, err = defras("run", str(file))
    assert code == 2
    assert f"{file}{place}" in err
    assert says in err


def test_a_region_outside_the_tissue(defras: Defras, tmp_path: Path) -> None:
    text = GOOD.format(rows="\n".join(ROWS)).replace("center_x_m: 0.0", "center_x_m: 0.2")
    code, _, err = defras("run", str(scene_file(tmp_path, text)))
    assert code == 2
    assert "mine.yaml:16:" in err
    assert "valid is -0.0450 to 0.0450" in err


def test_no_attachment_at_all(defras: Defras, tmp_path: Path) -> None:
    text = GOOD.format(rows="\n".join(ROWS)).replace("#", ".")
    code, _, err = defras("run", str(scene_file(tmp_path, text)))
    assert code == 2
    assert "mark at least one with #" in err


def test_all_faults_of_a_file_at_once(defras: Defras, tmp_path: Path) -> None:
    file = scene_file(tmp_path, tisue="{}", motoin="{}", ram="{}")
    _, _, err = defras("scene", "check", str(file))
    assert err.count(str(file)) == 3


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"a: [1", b"- 1\n- 2\n", b""])
def test_a_file_that_is_no_scene(defras: Defras, tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "broken.yaml"
    file.write_bytes(content)
    code, _, err = defras("scene", "check", str(file))
    assert code == 2
    assert str(file) in err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("run", "nowhere.yaml"), "nowhere.yaml"),
        (("run", "demo", "--world", "mars"), "model, bullet"),
        (("run", "demo", "--world", "dvrk"), "--setup"),
        (("run", "demo", "--tree", "oak"), "defras"),
        (("run", "demo", "--seed", "-1"), "seed"),
        (("tree", "check", "nothing"), "nothing"),
        (("view", "nowhere"), "run.rrd"),
        (("benchmark", "table1", "--trees", "oak"), "oak"),
        (("dance",), "dance"),
    ],
)
def test_words_off(defras: Defras, arguments: tuple[str, ...], says: str) -> None:
    code, _, err = defras(*arguments)
    assert code == 2
    assert says in err
