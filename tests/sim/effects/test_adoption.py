"""A scene says at which line and column it adopts what it cannot, and what would be valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from defras_sim.scene import load_scene
from defras_sim.yaml_source import InvalidFile

SCENE = """\
name: small
attachments:
  map: ["##", "##"]
  hole_pitch_m: 0.05
roi: {center_x_m: 0.0, center_y_m: 0.0}
model:
  effects:
    - {effect: stress_relaxation, fraction: 0.35, time_s: 2.0}
    - effect: EFFECT
"""


def scene_file(folder: Path, effect: str) -> Path:
    file = folder / "scene.yaml"
    file.write_text(SCENE.replace("effect: EFFECT", effect))
    return file


def test_adopted_effects_are_read_with_their_parameters(tmp_path: Path) -> None:
    scene = load_scene(scene_file(tmp_path, "{effect: depth_bias, scale: 1.01, offset_m: 0.002}"))
    assert scene.model.extension == {
        "stress_relaxation": {"fraction": 0.35, "time_s": 2.0},
        "depth_bias": {"scale": 1.01, "offset_m": 0.002},
    }


def test_a_scene_extended_in_a_program_is_one_that_was_read(tmp_path: Path) -> None:
    scene = load_scene(scene_file(tmp_path, "{effect: depth_bias, scale: 1.01}"))
    again = scene.extended({}).extended(scene.model.extension)
    assert again == scene
    assert type(scene).model_validate(scene.model_dump(mode="json")) == scene


@pytest.mark.parametrize(
    ("effect", "place", "words"),
    [
        ("effect: deth_bias", "9:7", "there is no effect 'deth_bias'; did you mean depth_bias?"),
        (
            "{effect: depth_bias, scal: 1.01}",
            "9:28",
            "depth_bias has no parameter 'scal'; did you mean scale? valid: scale, offset_m",
        ),
        (
            "{effect: depth_bias, scale: 12}",
            "9:28",
            "scale: 12 is out of bounds; reported to true depth should be between 0.8 and 1.25",
        ),
        ("{effect: depth_bias, scale: near}", "9:28", "should be a valid number"),
        ("{effect: depth_bias, scale: .nan}", "9:28", "should be a finite number"),
        ("{effect: stress_relaxation}", "9:8", "stress_relaxation is adopted twice"),
        (
            "{effect: gravity, acceleration_m_s2: -2.0}",
            "9:7",
            "-2 would make the scene's 0 m/s^2 negative",
        ),
    ],
)
def test_what_cannot_be_adopted_is_told_at_its_place(
    tmp_path: Path, effect: str, place: str, words: str
) -> None:
    file = scene_file(tmp_path, effect)
    with pytest.raises(InvalidFile) as raised:
        load_scene(file)
    (fault,) = raised.value.faults
    assert str(fault).startswith(f"{file}:{place}: model.effects.1")
    assert words in str(fault)
