"""A rule is added to a scene file, and everything else stays."""

from __future__ import annotations

import pytest

from defras_bt.planning.advice_file import add_advice, rule_name
from defras_sim.advice import Advice
from defras_sim.scene import load_scene
from defras_sim.yaml_source import InvalidFile

ROWS = "\n".join(f'    - "{row}"  # row {i}' for i, row in enumerate(["#" * 12] + ["." * 12] * 11))
TEXT = f"""# my patient
name: mine
attachments:
  map:
{ROWS}
roi: {{center_x_m: 0.0, center_y_m: 0.02}}   # seen in the CT
"""
VEIN = Advice(name="vein", reason="a vein runs there", forbid="grasp point (2,3)")


@pytest.fixture
def file(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(TEXT)
    return file


def test_the_rule_is_in_the_file_and_all_else_stays(file):
    scene = add_advice(file, VEIN)
    assert scene.advice == (VEIN,) == load_scene(file).advice
    assert file.read_text().startswith(TEXT.rstrip("\n"))
    second = VEIN.model_copy(update={"name": "other"})
    assert add_advice(file, second).advice == (VEIN, second)
    assert [p.name for p in file.parent.iterdir()] == ["mine.yaml"]


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (VEIN, "another rule is named 'vein' already"),
        (
            Advice(name="far", reason="x", prefer="point (9,9)"),
            r"\(9, 9\) is no grasp point; valid are \(1,1\) to \(5,5\)",
        ),
    ],
)
def test_a_rule_that_does_not_fit_leaves_the_file_alone(file, rule, message):
    add_advice(file, VEIN)
    before = file.read_text()
    with pytest.raises(InvalidFile, match=message):
        add_advice(file, rule)
    assert file.read_text() == before


def test_the_place_of_a_fault_stands_in_the_file_as_it_is(file):
    """The user never sees the trial with the rule in it, and can look up every place told."""
    far = Advice(name="far", reason="x", prefer="point (9,9)")
    with pytest.raises(InvalidFile) as caught:
        add_advice(file, far)
    (fault,) = caught.value.faults
    assert (fault.file, fault.line, fault.column) == (file, 1, 1)
    assert fault.message.startswith("cannot take the rule 'far': ")
    add_advice(file, VEIN)
    with pytest.raises(InvalidFile) as caught:
        add_advice(file, far)
    (fault,) = caught.value.faults
    assert file.read_text().splitlines()[fault.line - 1] == "advice:"


def test_a_layer_keeps_the_rules_of_its_base(file):
    add_advice(file, VEIN)
    layer = file.with_name("layer.yaml")
    layer.write_text("extends: mine.yaml\nname: layer\n")
    rule = Advice(name="arm", reason="x", forbid="psm2")
    assert add_advice(layer, rule).advice == (VEIN, rule)


def test_names_for_rules_without_one():
    assert rule_name("forbid", "grasp psm1 point (2,3)") == "forbid-grasp-psm1-point-2-3"
