from __future__ import annotations

from py_trees.common import Status

from defras_bt.planning.nodes import PlanFitsBelief


def test_without_a_plan_it_fails(bench):
    node = bench.node(PlanFitsBelief)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "no_plan"


def test_a_plan_made_with_the_belief_fits(bench):
    bench.board.plan_belief = bench.scene.attached
    node = bench.node(PlanFitsBelief)
    assert bench.tick(node) == Status.SUCCESS


def test_a_learned_hole_outdates_the_plan(bench):
    bench.board.plan_belief = ~bench.scene.attached
    node = bench.node(PlanFitsBelief)
    assert bench.tick(node) == Status.FAILURE
    assert node.code == "outdated"
