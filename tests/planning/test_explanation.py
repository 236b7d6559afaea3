"""Reasons are worded, and why another point was not taken."""

from __future__ import annotations

import re

import pytest

from defras_bt.planning.english import reason_sentence
from defras_bt.planning.execution import Execution
from defras_bt.planning.explanation import why_not, why_not_rehearsed
from defras_bt.planning.plan import ArmSituation, Situation
from defras_bt.planning.planner import Planner
from defras_bt.planning.preoperative import result_of
from defras_sim.advice import Advice, Matter, matter_of
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
        (ArmSituation(), set(), (5, 1), "The plan does that: step 1."),
        (
            ArmSituation(),
            {(1, 1)},
            (1, 1),
            "No plan can act at (1,1): grasp point (1,1) is blocked.",
        ),
        (
            READY,
            set(),
            (5, 1),
            "A plan to act at (5,1) takes 2 actions more:\n"
            "1. PSM2 reaches grasp point (5,1).\n"
            "2. PSM2 opens its jaw at (5,1).\n"
            "3. PSM2 grasps the tissue at (5,1).\n"
            "4. PSM2 pulls the tissue up, held at (5,1).\n"
            "5. PSM2 folds the tissue away from the endoscope, held at (5,1).",
        ),
        (
            ArmSituation(),
            set(),
            (1, 5),
            "A plan to act at (1,5) takes as many actions, but the optimisation prefers (5,1): "
            "(1,5) is 7 mm from the nearest believed attachment and 86 mm from the region of "
            "interest, (5,1) is 121 mm from the nearest believed attachment and 58 mm from the "
            "region of interest.",
        ),
    ],
)
def test_why_not(scene, psm1, blocked, point, answer):
    situation = Situation({**IDLE, "psm1": psm1}, frozenset(blocked))
    plan = Planner(scene).plan(situation, scene.attached)
    asked = Matter(None, None, point)
    assert why_not(scene, situation, scene.attached, plan, asked) == answer


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


EXECUTIONS = (
    Execution((2, 5), ("pull", "fold"), 0.9, 0.10, True),
    Execution((3, 5), ("pull", "fold"), 0.6, 0.05, True),
    Execution((4, 5), ("pull", "fold"), 1.0, 0.90, True),
    Execution((5, 5), ("pull", "move", "fold"), 0.9, 0.20, True),
)


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        ("grasp psm1 point (2,5)", "The plan does that: step 3."),
        ("grasp point (3,5)", "the best shows 60% of the region with at most 0.05 N; the goal is"),
        ("grasp point (4,5)", "with at most 0.90 N; the threshold is 0.30 N."),
        ("move", "the gentlest such needs 0.20 N. The plan needs 0.10 N in 5 actions"),
        ("grasp point (1,1)", "A plan to grasp at (1,1) takes as many actions"),
        ("grasp psm2 point (2,5)", "No plan can grasp with PSM2 at (2,5)"),
    ],
)
def test_why_the_rehearsed_plan_is_not_another(scene, asked, answer):
    result = result_of(scene, EXECUTIONS, 0.15)
    assert answer in why_not_rehearsed(scene, result, matter_of(asked))


def test_a_rule_is_the_reason(scene):
    rule = Advice(name="vein", reason="a vein", forbid="grasp point (2,5)")
    ruled = scene.model_copy(update={"advice": (rule,)})
    result = result_of(ruled, EXECUTIONS, 0.15)
    assert result.chosen.point == (5, 5)
    answer = why_not_rehearsed(ruled, result, matter_of("point (2,5)"))
    assert 'not allowed: the rule "vein" forbids: grasp point (2,5) (a vein)' in answer
