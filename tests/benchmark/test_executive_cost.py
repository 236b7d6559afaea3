"""The benchmark of the executive measures what it says: the same ticks, nothing left out twice."""

from __future__ import annotations

import time

import numpy as np
import pytest

from defras_bt.benchmark.bare_tree import BareTree
from defras_bt.benchmark.executive import Stopwatch, measure, plan_of_length
from defras_bt.executive.testing import NodeBench, bench_scene
from defras_bt.planning.plan import MANOEUVRES
from defras_sim.resources import resource
from tests.executive.stage import Stage


def test_a_plan_has_the_length_asked_for_and_can_be_carried_out() -> None:
    plan = plan_of_length(30)
    assert [action.time for action in plan.actions] == list(range(1, 31))
    held = False
    for before, action in zip((None, *plan.actions), plan.actions, strict=False):
        if action.name in (*MANOEUVRES, "release"):
            assert held, action
            assert before is not None
            assert before.point == action.point
        held = action.name in ("grasp", *MANOEUVRES)


def test_the_bare_tree_goes_the_same_way_tick_by_tick() -> None:
    tree = resource("trees/defras.yaml")
    stage = Stage("defras", NodeBench(preoperative=plan_of_length(9)))
    stage.until("the tissue is held", lambda record: bool(stage.board.grips))
    stage.warn(2)
    stage.ticks(1.0)
    bare = BareTree(tree, stage.notes.records)
    for _ in stage.notes.records:
        bare.prepare()
        bare.tick()
        bare.check()


def test_a_stopwatch_adds_up_what_it_is_put_around() -> None:
    watch = Stopwatch()
    for _ in range(2):
        with watch:
            time.sleep(0.01)
    cpu_s, wall_s = watch.take_s()
    assert wall_s >= 0.02
    assert 0 <= cpu_s < wall_s
    np.testing.assert_array_equal(watch.take_s(), [0, 0])


def test_every_part_is_told_for_the_same_ticks() -> None:
    rows = {
        row["per tick"]: row
        for row in measure(resource("trees/defras.yaml"), bench_scene(), actions=2, repeats=1)
    }
    assert len({row["ticks"] for row in rows.values()}) == 1
    parts = ("of it all else", "executive", "executive, recording")
    medians = [rows[part]["CPU median ms"] for part in parts]
    assert medians == sorted(medians)
    assert rows["bare py_trees"]["median / bare"] == pytest.approx(1.0)
