"""The planning benchmark: what it asks and what it reports."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from defras_bt.benchmark.planner import planning_times, questions
from defras_sim.resources import resource
from defras_sim.scene import load_scene

SCENE = load_scene(Path(resource("sim/scenes/demo.yaml")))


def test_both_kinds_of_planner_are_timed_on_the_same_questions():
    ticks = itertools.count()
    found = list(planning_times(SCENE, 3, grids=(3,), count=12, clock=lambda: float(next(ticks))))
    assert [timing.asked for timing in found] == ["situation", "situation and belief"]
    for timing in found:
        assert timing.warm_s == (1.0,) * 12
        assert timing.row()["fresh / warm"] == 1.0
        assert timing.row()["grasp points"] == "3 x 3"


def test_beliefs_change_only_where_asked():
    same = list(questions(SCENE, np.random.default_rng(0), 5, new_belief=False))
    assert all(np.array_equal(q.attached, SCENE.attached) for q in same)
    other = list(questions(SCENE, np.random.default_rng(0), 5, new_belief=True))
    changes = [int(np.sum(a.attached != b.attached)) for a, b in itertools.pairwise(other)]
    assert all(1 <= change <= 3 for change in changes)
