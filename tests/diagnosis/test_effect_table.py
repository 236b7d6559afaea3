"""docs/diagnosis.md lists the effects that there are."""

from __future__ import annotations

from pathlib import Path

import pytest

import defras_bt.diagnosis as package
from defras_bt.diagnosis.effect_table import effect_table, excitation_table, renewed
from defras_bt.diagnosis.report_files import REPORT, SCENE, TIMELINE, VERDICT
from defras_bt.diagnosis.topic_map import read_topic_map
from defras_sim.effects.library import effects

DOCUMENT = Path(package.__file__).parents[2] / "docs" / "diagnosis.md"
OWN = [effect for effect in effects() if type(effect).__module__.startswith("defras_sim.")]


def test_every_effect_is_listed_as_it_is() -> None:
    said = DOCUMENT.read_text(encoding="utf-8")
    remedy = "run: python -m defras_bt.diagnosis.effect_table docs/diagnosis.md"
    assert said == renewed(said, OWN), remedy
    assert said.endswith(excitation_table(OWN))


def test_tables_are_renewed_and_all_else_is_kept() -> None:
    said = DOCUMENT.read_text(encoding="utf-8")
    fewer = renewed(said, OWN[:3])
    assert len(fewer) < len(said)
    assert renewed(fewer, OWN) == said
    with pytest.raises(ValueError, match="no table that begins with"):
        renewed("# Something else", OWN)


def test_every_parameter_stands_in_the_table_with_its_unit() -> None:
    for effect in OWN:
        (row,) = effect_table([effect]).splitlines()[2:]
        assert row.startswith(f"| `{effect.name}` | {effect.layer} | ")
        for parameter in effect.parameters:
            assert f"`{parameter.name}`" in row
            assert f"[{parameter.unit or '1'}]" in row


def test_files_are_called_as_documented() -> None:
    said = DOCUMENT.read_text(encoding="utf-8")
    assert all(f"`{name}`" in said for name in (VERDICT, SCENE, REPORT, TIMELINE))


def test_the_topic_map_shown_is_one(tmp_path: Path) -> None:
    shown = DOCUMENT.read_text(encoding="utf-8").split("```yaml\n")[1].split("```")[0]
    (tmp_path / "map.yaml").write_text(shown)
    assert read_topic_map(tmp_path / "map.yaml").cloud.clock_offset_s == -0.03
