"""What is written can be read, by programs and by people."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from defras_sim.resources import resource
from defras_sim.scene import load_scene
from defras_sim.scene_file import SCHEMA_LINE, schema_text, write_scene, write_variant
from defras_sim.scene_generator import draw_actual, draw_believed


def test_a_written_scene_reads_back_the_same(tmp_path: Path) -> None:
    scene = draw_believed(np.random.default_rng(0), name="drawn")
    write_scene(scene, tmp_path / "drawn.yaml")
    assert load_scene(tmp_path / "drawn.yaml") == scene
    text = (tmp_path / "drawn.yaml").read_text()
    assert text.startswith(SCHEMA_LINE)
    assert f'    - "{scene.attachments.map[0]}"\n' in text


def test_everything_that_differs_from_the_defaults_is_written(tmp_path: Path) -> None:
    scene = draw_believed(np.random.default_rng(0), name="drawn")
    tissue = scene.tissue.model_copy(update={"elements_xyz": (6, 6, 1), "young_modulus_pa": 4e3})
    changed = scene.model_copy(update={"tissue": tissue})
    write_scene(changed, tmp_path / "drawn.yaml")
    assert load_scene(tmp_path / "drawn.yaml") == changed
    assert "elements_xyz: [6, 6, 1]" in (tmp_path / "drawn.yaml").read_text()


def test_a_variant_is_the_base_with_other_attachments(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    base = draw_believed(rng, name="base")
    actual = draw_actual(base, "more", rng)
    write_scene(base, tmp_path / "base.yaml")
    write_variant(actual, "base.yaml", tmp_path / "base_more.yaml")
    assert load_scene(tmp_path / "base_more.yaml") == actual


def test_the_shipped_schema_is_that_of_the_code() -> None:
    assert resource("sim/scenes/scene.schema.json").read_text() == schema_text()
