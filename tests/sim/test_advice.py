"""Rules of an expert: what they say and what they cover."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from defras_sim.advice import Advice, Matter, matter_of


@pytest.mark.parametrize(
    ("text", "matter"),
    [
        ("grasp psm1 point (2,3)", Matter("grasp", "psm1", (2, 3))),
        ("fold", Matter("fold", None, None)),
        (" PSM2 ", Matter(None, "psm2", None)),
        ("point ( 4 , 2 )", Matter(None, None, (4, 2))),
        ("pull point (1,1)", Matter("pull", None, (1, 1))),
    ],
)
def test_what_a_rule_is_about(text, matter):
    assert matter_of(text) == matter


@pytest.mark.parametrize("text", ["", "cut", "psm3", "release psm1", "point 2,3", "psm1 grasp"])
def test_other_texts_are_refused_with_what_is_valid(text):
    with pytest.raises(ValueError, match=r"valid is an action, an arm, a point"):
        matter_of(text)


def test_a_matter_covers_what_it_does_not_exclude():
    fold = matter_of("fold psm1")
    assert fold.covers("fold", "psm1", (1, 1))
    assert not fold.covers("fold", "psm2", (1, 1))
    assert not fold.covers("pull", "psm1", (1, 1))


@pytest.mark.parametrize(
    "changes",
    [{"prefer": "fold"}, {"forbid": None}, {"forbid": "cut"}, {"name": "A rule"}, {"reason": ""}],
)
def test_a_rule_says_one_thing_has_a_name_and_a_reason(changes):
    with pytest.raises(ValidationError):
        Advice.model_validate({"name": "vein", "reason": "x", "forbid": "fold", **changes})


def test_a_rule_reads_as_a_sentence():
    rule = Advice(name="vein", reason="a vein runs there", forbid="grasp point (2,3)")
    assert rule.sentence() == 'the rule "vein" forbids: grasp point (2,3) (a vein runs there)'
