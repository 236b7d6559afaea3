"""The choice after the rehearsals that it needs is that after all of them."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.planning.choice import choose
from defras_bt.planning.engine import Engine
from defras_bt.planning.gentlest import rehearse_gentlest
from defras_bt.planning.preoperative import preoperative_plan, result_of
from defras_bt.planning.rehearsals import reachable_points
from defras_sim.retraction import arm_for
from tests.planning.conftest import make_scene, same_outcomes

STEP_M = 0.01


@pytest.fixture(scope="module")
def small():
    return make_scene(3, 2, 0.02, tissue={"elements_xyz": (4, 4, 1)})


@pytest.fixture(scope="module")
def everything(small):
    return preoperative_plan(small, engine=Engine(jobs=1), step_m=STEP_M)


@pytest.mark.parametrize("share", [0.15, 0.4, 1.0, 2.0])
def test_the_choice_is_the_same(small, everything, share):
    limit_n = share * everything.force_threshold_n
    needed = rehearse_gentlest(small, limit_n, step_m=STEP_M)
    visibility = small.thresholds.roi_visibility
    chosen = choose(needed, visibility, limit_n)
    best = choose(everything.executions, visibility, limit_n)
    assert same_outcomes([e for e in [chosen] if e], [e for e in [best] if e])
    assert {e.point for e in needed} == {e.point for e in everything.executions}


def test_what_cannot_be_chosen_is_not_followed_to_its_end(small, everything):
    limit_n = 0.4 * everything.force_threshold_n
    needed = rehearse_gentlest(small, limit_n, step_m=STEP_M)
    rough = {e.point: e for e in needed if e.force_max_n > limit_n}
    assert rough
    whole_n = {p: max(e.force_max_n for e in everything.executions if e.point == p) for p in rough}
    assert all(rough[p].force_max_n <= whole_n[p] for p in rough)
    assert any(rough[p].force_max_n < whole_n[p] for p in rough)


def test_what_a_rule_forbids_makes_no_room_for_others(small, everything):
    assert everything.chosen is not None
    point = everything.chosen.point
    rule = {
        "forbid": f"grasp {arm_for(small, point)} point ({point[0]},{point[1]})",
        "name": "not_there",
        "reason": "tested",
    }
    ruled = type(small).model_validate({**small.model_dump(), "advice": [rule]})
    threshold_n = everything.force_threshold_n
    needed = result_of(ruled, rehearse_gentlest(ruled, threshold_n, step_m=STEP_M), threshold_n / 2)
    whole = result_of(ruled, everything.executions, threshold_n / 2)
    assert same_outcomes([e for e in [needed.chosen] if e], [e for e in [whole.chosen] if e])
    assert needed.chosen is None or needed.chosen.point != point


def test_tissue_that_nothing_holds_is_rehearsed_too(small):
    free = small.with_attached(np.zeros(len(small.attached), dtype=bool))
    found = rehearse_gentlest(free, 0.1, step_m=0.03)
    assert {e.point for e in found} == set(reachable_points(free))
