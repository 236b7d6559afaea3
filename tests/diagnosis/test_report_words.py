"""Verdicts in sentences."""

from __future__ import annotations

import math
from typing import Any

import pytest

from defras_bt.diagnosis.report_words import (
    either,
    estimate_words,
    joined,
    key_words,
    quantity,
    readable,
    spoken,
    verdict_sentence,
)
from defras_bt.diagnosis.verdict import Cause, Estimate, Gain, Verdict, VerdictName
from defras_sim.effects.library import effect

OFFSET = Cause("depth_bias", "", {"offset_m": Estimate(0.002, "m", (0.0018, 0.0022))}, 0.8)


def verdict(name: VerdictName, **fields: Any) -> Verdict:
    values: dict[str, Any] = {
        "verdict": name,
        "causes": (),
        "ambiguous": (),
        "excluded": {},
        "gain": Gain(),
        "unexplained_share": None,
        **fields,
    }
    return Verdict(**values)


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.0025, "m", "2.5 mm"),
        (math.pi / 4, "rad", "45 °"),
        (0.35, "", "0.35"),
        (2.0, "s", "2 s"),
        (math.inf, "m", "unlimited"),
    ],
)
def test_numbers_are_given_in_units_that_people_read(value: float, unit: str, shown: str) -> None:
    assert quantity(value, unit) == shown


def test_an_interval_says_what_the_data_do_not_limit() -> None:
    assert estimate_words(Estimate(0.002, "m", (0.0018, 0.0022))) == "2 mm (90 %: 1.8 to 2.2 mm)"
    assert estimate_words(Estimate(2.0, "s", (1.5, math.inf))) == "2 s (90 %: more than 1.5 s)"
    assert estimate_words(Estimate(2.0, "s", (-math.inf, 4.0))) == "2 s (90 %: less than 4 s)"
    free = Estimate(2.0, "s", (-math.inf, math.inf))
    assert estimate_words(free) == "2 s (any value fits the data as well)"


def test_names_are_words() -> None:
    assert key_words("joint_play@q5") == "joint play (q5)"
    assert [spoken(n) for n in ("offset_m", "scale", "compliance_m_per_n", "x_m")] == [
        "offset",
        "scale",
        "compliance",
        "x",
    ]
    assert either(["a"]) == "a"
    assert either(["a", "b", "c"]) == "a, b or c"
    assert joined(["a", "b"]) == "a and b"


def test_keys_within_sentences_become_words() -> None:
    said = "A part looks like joint_play@q6, joint_coupling@q6<-q4,q5,q6, servo_lag, not of_this."
    assert readable(said, {"joint_play", "joint_coupling", "servo_lag"}) == (
        "A part looks like joint play (q6), joint coupling (q6<-q4,q5,q6), servo lag, not of_this."
    )


def test_a_named_cause_is_told_with_its_meaning_and_its_gain() -> None:
    relaxation = effect("stress_relaxation")
    cause = Cause(relaxation.name, "", {"time_s": Estimate(2.0, "s", (1.5, 2.5))}, 0.8)
    told = verdict_sentence(
        verdict("named", causes=(cause,), gain=Gain(in_range=0.83)), {relaxation.name: relaxation}
    )
    assert told.startswith("This is missing from the simulation: ")
    assert f"{relaxation.sentence[1:-1]} (stress relaxation: time 2 s)." in told
    assert "loses 83 % of its error" in told


def test_a_gain_that_is_none_or_a_loss_is_said() -> None:
    assert "could not be measured" in verdict_sentence(verdict("named", causes=(OFFSET,)), {})
    lost = verdict("named", causes=(OFFSET,), gain=Gain(in_range=-0.1))
    assert "no better" in verdict_sentence(lost, {})


def test_a_set_says_what_cannot_be_told_apart() -> None:
    told = verdict_sentence(verdict("set", ambiguous=("stiffness", "joint_play@q5")), {})
    assert "cannot tell why: stiffness or joint play (q5)." in told


def test_outside_says_how_much_is_left_and_what_is_known_of_it() -> None:
    told = verdict_sentence(verdict("outside", causes=(OFFSET,), unexplained_share=0.6), {})
    assert "none of the known causes explains; 60 % of the error stays unexplained" in told
    assert "Part of it is known: depth bias: offset 2 mm." in told


def test_nothing_is_said_as_far_as_the_sensors_can_tell() -> None:
    assert "as well as the sensors can tell" in verdict_sentence(verdict("nothing"), {})
