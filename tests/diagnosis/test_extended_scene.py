"""An extended scene is one that the executive runs."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from defras_bt.diagnosis.extended_scene import FULL_NAME, adopted_effects, write_extended_scene
from defras_bt.diagnosis.verdict import Cause, Estimate
from defras_sim.resources import resource
from defras_sim.scene import load_scene
from defras_sim.yaml_source import InvalidFile
from tests.diagnosis.synthetic_diagnosis import SCENE_FILE, named_verdict, synthetic_scene


def depth_bias(**values: float) -> Cause:
    parameters = {name: Estimate(value, "m", (value, value)) for name, value in values.items()}
    return Cause("depth_bias", "", parameters, 0.1)


def test_named_effects_are_adopted_over_the_believed_scene(tmp_path: Path) -> None:
    verdict = named_verdict()
    scene = write_extended_scene(SCENE_FILE, verdict, tmp_path / "extended_scene.yaml")
    assert scene == load_scene(tmp_path / "extended_scene.yaml")
    (adopted,) = scene.model.effects
    assert (adopted.effect, adopted.model_extra) == (
        "stress_relaxation",
        {"fraction": 0.35, "time_s": 2.0},
    )
    believed = synthetic_scene()
    assert scene.attachments == believed.attachments
    assert scene.model_copy(update={"name": believed.name}) != believed


def test_what_was_extended_can_be_extended_again(tmp_path: Path) -> None:
    first, second = tmp_path / "a" / "scene.yaml", tmp_path / "b" / "scene.yaml"
    for file in (first, second):
        file.parent.mkdir()
    write_extended_scene(SCENE_FILE, named_verdict(), first)
    more = replace(named_verdict(), causes=(depth_bias(offset_m=0.002),))
    scene = write_extended_scene(first, more, second)
    assert [each.effect for each in scene.model.effects] == ["stress_relaxation", "depth_bias"]
    newer = Cause("stress_relaxation", "", {"fraction": Estimate(0.5, "", (0.4, 0.6))}, 0.1)
    values = adopted_effects(scene, replace(more, causes=(newer,)))
    assert values[0] == {"effect": "stress_relaxation", "fraction": 0.5, "time_s": 2.0}


def test_what_cannot_be_told_apart_is_not_adopted_but_remarked(tmp_path: Path) -> None:
    cause = replace(named_verdict().causes[0], cannot_tell=("softening",))
    verdict = replace(
        named_verdict(),
        verdict="set",
        causes=(cause,),
        ambiguous=("stress_relaxation", "softening"),
    )
    scene = write_extended_scene(SCENE_FILE, verdict, tmp_path / "scene.yaml")
    assert scene.model.effects == ()
    said = (tmp_path / "scene.yaml").read_text()
    assert "# Not adopted, because it cannot be told from softening: stress relaxation" in said


def test_nothing_found_extends_by_nothing(tmp_path: Path) -> None:
    verdict = replace(named_verdict(), verdict="nothing", causes=())
    assert write_extended_scene(SCENE_FILE, verdict, tmp_path / "scene.yaml").model.effects == ()


def test_two_sites_of_an_effect_are_laid_together() -> None:
    verdict = replace(named_verdict(), causes=(depth_bias(offset_m=0.002), depth_bias(scale=1.01)))
    assert adopted_effects(synthetic_scene(), verdict) == [
        {"effect": "depth_bias", "offset_m": 0.002, "scale": 1.01}
    ]


def test_an_effect_is_in_a_model_once() -> None:
    twice = (depth_bias(offset_m=0.002), depth_bias(offset_m=0.003))
    with pytest.raises(ValueError, match=r"offset_m of both 0\.002 and 0\.003"):
        adopted_effects(synthetic_scene(), replace(named_verdict(), causes=twice))


def test_an_anatomy_travels_with_its_scene(tmp_path: Path) -> None:
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    out.mkdir()
    for name in ("flap.yaml", "flap.npz"):
        shutil.copy(resource("sim/scenes") / name, source / name)
    write_extended_scene(source / "flap.yaml", named_verdict(), out / "scene.yaml")
    shutil.rmtree(source)
    scene = load_scene(out / "scene.yaml")
    assert scene.tissue.anatomy is not None
    assert (out / FULL_NAME).is_file()


def test_an_effect_that_is_not_installed_is_refused_at_its_place(tmp_path: Path) -> None:
    verdict = replace(named_verdict(), causes=(Cause("gremlins", "", {}, 0.1),))
    with pytest.raises(InvalidFile, match=r"scene\.yaml:\d+:\d+: .*gremlins"):
        write_extended_scene(SCENE_FILE, verdict, tmp_path / "scene.yaml")
