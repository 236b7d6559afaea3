"""Codes are stable, documented, and say what helps against them."""

import doctest
import re
from pathlib import Path

import pytest

from defras_bt.executive import reasons
from defras_bt.executive.reasons import Code, ReasonCode, Remedy, codes_table, helps

LEAVES = ("acting", "monitoring", "learning", "diagnosis", "planning", "executive")
PACKAGE = Path(reasons.__file__).parent.parent


def test_every_code_is_a_word_with_a_meaning():
    for code in Code:
        assert re.fullmatch(r"[a-z][a-z_]*", code.value)
        assert code.meaning
        assert code.name.lower() == code.value


def test_the_words_are_these_and_stay_these():
    """Programs count and compare them: a word that is changed breaks somebody's program."""
    said = " ".join(sorted(code.value for code in Code))
    kept = Path(__file__).with_name("codes.txt").read_text(encoding="utf-8")
    assert set(kept.split()) <= set(said.split()), "a code was removed or renamed"


def test_every_leaf_reports_codes_of_the_list_and_every_code_is_reported():
    text = "\n".join(
        file.read_text(encoding="utf-8")
        for part in LEAVES
        for file in (PACKAGE / part).rglob("*.py")
        if file.name != "reasons.py"
    )
    bare = re.findall(r"self\.(?:succeed|fail|run)\(\s*f?\"", text)
    assert not bare, "a leaf reports a word that is no Code"
    used = set(re.findall(r"\bCode\.([A-Z_]+)", text))
    assert used == {code.name for code in Code}


@pytest.mark.parametrize(
    ("remedy", "code", "expected"),
    [
        (Remedy.REPLAN, Code.PLAN_REFUSED, False),
        (Remedy.REPLAN, Code.IMPOSSIBLE, False),
        (Remedy.REPLAN, Code.JAW_STUCK, False),
        (Remedy.REPLAN, Code.NOTHING_GRASPED, True),
        (Remedy.LEARN, Code.STALE, False),
        (Remedy.LEARN, Code.WARNED, True),
        (Remedy.LET_GO, Code.FORCE_UNKNOWN, True),
        (Remedy.LET_GO, Code.PAUSED, False),
        (Remedy.HUMAN, Code.PLAN_REFUSED, True),
    ],
)
def test_what_helps(remedy, code, expected):
    assert helps(remedy, code) == expected


@pytest.mark.parametrize("code", [Code.STALE, Code.STOPPED, Code.PAUSED, Code.TAKEN_OVER])
def test_no_machine_acts_on_its_own_without_data_or_against_the_operator(code):
    assert not code.remedies & {Remedy.REPLAN, Remedy.LEARN, Remedy.LET_GO}


def test_a_word_that_is_no_code_rules_nothing_out():
    assert all(helps(remedy, "too_cold") for remedy in Remedy)


def test_a_package_can_have_codes_of_its_own():
    class ProbeCode(ReasonCode):
        WET = "wet", "the probe is wet", "human"

    assert ProbeCode.WET == "wet"
    assert not helps(Remedy.WAIT, ProbeCode.WET)
    assert codes_table([*ProbeCode]).splitlines()[-1] == "| `wet` | the probe is wet | human |"


def test_a_remedy_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="prayer"):

        class ProbeCode(ReasonCode):
            LOST = "lost", "the probe is lost", "prayer"


def test_the_documentation_lists_every_code_as_it_is():
    documented = (PACKAGE.parent / "docs" / "reasons.md").read_text(encoding="utf-8")
    assert documented.endswith(codes_table())


def test_the_examples_are_true():
    assert doctest.testmod(reasons).failed == 0
