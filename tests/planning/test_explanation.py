"""Reasons are worded, and why another point was not taken."""

from __future__ import annotations

import re

import pytest

from defras_bt.planning.english import reason_sentence
from defras_bt.planning.explanation import why_not
from defras_bt.planning.plan import ArmSituation, Situation
from defras_bt.planning.planner import Planner
from defras_sim.resources import resource

IDLE = {"psm1": ArmSituation(), "psm2": ArmSituation()}


def test_every_reason_of_the_program_is_worded():
    text = resource("asp/explain.lp").read_text()
    reasons = set(re.findall(r"because\(\w+\([^)]*\), (\w+), t\)", text))
    assert len(reasons) >= 9
    for reason in reasons:
        assert reason_sentence(reason, (1, 1))


def test_an_unworded_reason_is_an_error():
    with pytest.raises(ValueError, match="gives reason 'whim'; worded are"):
        reason_sentence("whim", (1, 1))


READY = ArmSituation(at=(2, 5), jaw_open=True)


@pytest.mark.parametrize(
    ("psm1", "blocked", "point", "answer"),
    [
        (ArmSituation(), set(), (5, 1), "The plan does use (5,1)."),
        (
            ArmSituation(),
            {(1, 1)},
            (1, 1),
            "(1,1) cannot be used: grasp point (1,1) is blocked; "
            "the plan must use grasp point (1,1).",
        ),
        (READY, set(), (5, 1), "Using (5,1) takes 2 actions more than using (2,5)."),
        (
            ArmSituation(),
            set(),
            (1, 5),
            "Using (1,5) takes as many actions, but the optimisation prefers (5,1): "
            "(1,5) is 7 mm from the nearest believed attachment and 86 mm from the region of "
            "interest, (5,1) is 121 mm from the nearest believed attachment and 58 mm from the "
            "region of interest.",
        ),
    ],
)
def test_why_not(scene, psm1, blocked, point, answer):
    planner = Planner(scene)
    situation = Situation({**IDLE, "psm1": psm1}, frozenset(blocked))
    plan = planner.plan(situation, scene.attached)
    assert why_not(planner, situation, scene.attached, plan, point) == answer


def test_starting_over_is_explained(scene):
    folded = ArmSituation(holding=(2, 5), done=("pull", "fold"))
    plan = Planner(scene).plan(
        Situation({**IDLE, "psm1": folded}),
        scene.attached,
        required_grasp=(2, 5),
        exposing=("pull", "move", "fold"),
    )
    assert [action.name for action in plan.actions][:2] == ["release", "reach"]
    assert plan.reasons[0] == "the manoeuvres still missing cannot follow those already done"
