"""Plans keep the rules that an expert added to the scene."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.planning.choice import forbidden
from defras_bt.planning.execution import Execution
from defras_bt.planning.plan import ArmSituation, Situation
from defras_bt.planning.planner import NoPlan, Planner
from defras_bt.planning.preoperative import result_of
from defras_sim.advice import Advice
from tests.planning.conftest import make_scene
from tests.planning.oracle import Oracle
from tests.planning.test_planner import IDLE, random_situation


def ruled(*rules, **grid):
    advice = tuple(
        Advice.model_validate({"name": f"r{i}", "reason": "so", **rule})
        for i, rule in enumerate(rules)
    )
    return make_scene(**grid).model_copy(update={"advice": advice})


def plan_of(scene, arms=IDLE, **options):
    return Planner(scene).plan(Situation(arms), scene.attached, **options)


def test_a_forbidden_point_is_not_used():
    free = plan_of(make_scene()).actions[0].point
    scene = ruled({"forbid": f"grasp point ({free[0]},{free[1]})"})
    assert plan_of(scene).actions[0].point != free


def test_a_forbidden_arm_does_nothing():
    scene = ruled({"forbid": "psm2"})
    assert {action.arm for action in plan_of(scene).actions} == {"psm1"}


def test_what_is_held_already_may_still_be_let_go():
    arms = {**IDLE, "psm2": ArmSituation(holding=(5, 1))}
    plan = plan_of(ruled({"forbid": "psm2"}), arms)
    assert str(plan.actions[0]) == "release(psm2,point,(5,1),1)"


def test_a_preferred_point_decides_between_plans_of_the_same_length():
    plan = plan_of(ruled({"prefer": "grasp psm1 point (3,4)"}))
    assert plan.actions[2].point == (3, 4)
    assert 'the rule "r0" prefers: grasp psm1 point (3,4) (so)' in plan.reasons[2]


def test_a_preference_makes_no_plan_longer():
    arms = {**IDLE, "psm1": ArmSituation(holding=(2, 5), done=("pull",))}
    assert len(plan_of(ruled({"prefer": "psm2"}), arms).actions) == 1


def test_rules_that_leave_no_plan_are_named():
    with pytest.raises(NoPlan) as caught:
        plan_of(ruled({"forbid": "fold"}, {"forbid": "point (1,1)"}))
    assert caught.value.obstacles == (
        "the region counts as exposed only after fold",
        'the rule "r0" forbids: fold (so)',
    )


def test_rehearsed_retractions_are_judged_by_the_same_rules():
    scene = ruled({"forbid": "fold psm1"})
    upper = Execution((2, 5), ("pull", "fold"), 1.0, 0.1, True)
    lower = Execution((2, 1), ("pull", "fold"), 1.0, 0.1, True)
    assert forbidden(scene, upper)
    assert not forbidden(scene, lower)
    assert not forbidden(scene, Execution((2, 5), ("pull",), 1.0, 0.1, True))


def test_without_an_allowed_retraction_the_rules_are_named():
    scene = ruled({"forbid": "fold psm1"})
    free = Execution((2, 5), ("pull",), 0.4, 0.1, True)
    folded = Execution((2, 5), ("pull", "fold"), 1.0, 0.1, True)
    reason = result_of(scene, (free, folded), 0.1).reason
    assert "none of the 1 rehearsed retractions shows 80% of the region" in reason
    assert "(the scene's rules forbid 1 others)" in reason


class RuledOracle(Oracle):
    """The breadth-first search without the forbidden steps."""

    def __init__(self, scene, blocked):
        super().__init__(scene, blocked)
        self.rules = [advice.matter for advice in scene.advice]

    def steps(self, state):
        for action, arm, point in super().steps(state):
            if action == "release" or not any(
                rule.covers(action, arm, point) for rule in self.rules
            ):
                yield action, arm, point


def test_plans_under_random_rules_agree_with_breadth_first_search():
    rng = np.random.default_rng(3)
    texts = ("psm1", "psm2", "grasp point (2,2)", "fold", "move psm1", "pull psm2 point (1,1)")
    attached = make_scene().attached
    unplannable = 0
    for _ in range(40):
        chosen = rng.choice(len(texts), size=rng.integers(1, 4), replace=False)
        scene = ruled(*({"forbid": texts[i]} for i in chosen), columns=3, rows=3)
        situation, required = random_situation(rng, scene)
        expected = RuledOracle(scene, situation.blocked).shortest(situation, required)
        planner = Planner(scene)
        if expected is None:
            unplannable += 1
            with pytest.raises(NoPlan):
                planner.plan(situation, attached, required_grasp=required)
        else:
            plan = planner.plan(situation, attached, required_grasp=required)
            assert len(plan.actions) == expected[0]
            assert not any(
                advice.matter.covers(a.name, a.arm, a.point)
                for a in plan.actions
                for advice in scene.advice
                if a.name != "release"
            )
    assert 5 < unplannable < 35
