"""Plans that work for sets of attachments around the belief."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.planning.choice import qualified
from defras_bt.planning.execution import Execution
from defras_bt.planning.journal import Journal
from defras_bt.planning.preoperative import preoperative_plans, result_of
from defras_bt.planning.robust import (
    Robustness,
    carried_out,
    choose_robust,
    robustness,
    sampled_beliefs,
)
from tests.planning.conftest import make_scene, same_outcomes


def execution(point, manoeuvres, visibility, force_max_n):
    return Execution(point, tuple(manoeuvres.split()), visibility, force_max_n, True)


GENTLE = execution((1, 1), "pull", 0.9, 0.05)
STURDY = execution((2, 1), "pull fold", 0.9, 0.10)
# With other attachments: the gentle one shows nothing, or tears at them; the other one works.
HIDDEN = (execution((1, 1), "pull", 0.1, 0.05), execution((2, 1), "pull", 0.85, 0.08))
ROUGH = (
    execution((1, 1), "pull", 0.9, 0.9),
    execution((2, 1), "pull", 0.3, 0.1),
    execution((2, 1), "pull fold", 0.9, 0.2),
)


def test_what_a_plan_would_be_with_other_attachments():
    assert carried_out(STURDY, HIDDEN) == HIDDEN[1], "exposed already after the pull"
    assert carried_out(STURDY, ROUGH) == ROUGH[2]
    with pytest.raises(ValueError, match=r"no rehearsal of \('pull',\) at \(3, 3\)"):
        carried_out(execution((3, 3), "pull", 1.0, 0.1), ROUGH)


def test_robustness_counts_goal_and_force():
    assert robustness(GENTLE, [HIDDEN, ROUGH], 0.8, 0.3).works_in == 1
    sturdy = robustness(STURDY, [HIDDEN, ROUGH], 0.8, 0.3)
    assert (sturdy.works_in, sturdy.sets) == (3, 3)
    assert sturdy.mean_force_n == pytest.approx((0.10 + 0.08 + 0.2) / 3)


def test_the_sturdier_retraction_is_chosen_though_another_is_gentler_as_believed():
    chosen, score = choose_robust([GENTLE, STURDY], [HIDDEN, ROUGH], 0.8, 0.3)
    assert chosen == STURDY
    assert score.sentence().startswith("it exposes the region within the force threshold in 3 of 3")
    assert choose_robust([GENTLE], [HIDDEN], 0.95, 0.3) is None


def test_samples_hold_fewer_and_more_holes_than_believed():
    scene = make_scene()
    samples = sampled_beliefs(scene, 30, np.random.default_rng(1))
    ratios = [s.attached.sum() / scene.attached.sum() for s in samples]
    assert min(ratios) < 0.7
    assert max(ratios) > 1.3
    assert all(0.35 <= ratio <= 1.65 for ratio in ratios)
    again = sampled_beliefs(scene, 30, np.random.default_rng(1))
    assert samples == again


def test_the_plan_says_in_how_many_sets_it_works():
    scene = make_scene()
    result = result_of(scene, (GENTLE, STURDY), 0.15, [HIDDEN, ROUGH])
    assert result.chosen == STURDY
    assert result.robustness == Robustness(3, 3, pytest.approx(0.38 / 3))
    assert result.reason.endswith("in 3 of 3 sets of attachments around the belief")


def test_only_what_works_as_believed_is_rehearsed_elsewhere(tmp_path):
    small = make_scene(3, 2, 0.02, tissue={"elements_xyz": (4, 4, 1)})
    ticks, journal = [], Journal(tmp_path / "journal")
    result = preoperative_plans(
        [small],
        step_m=0.01,
        samples=2,
        rng=np.random.default_rng(0),
        journal=journal,
        progress=lambda *tick: ticks.append(tick),
    )[0]
    points = {e.point for e in qualified(small, result.executions, result.force_median_n)}
    assert 0 < len(points) < 6
    assert ticks[-1] == (6 + 2 * len(points),) * 2
    assert ticks == sorted(ticks)
    assert result.robustness is not None
    assert result.robustness.sets == 3


def test_samples_do_not_count_for_epsilon_and_need_a_generator():
    small = make_scene(2, 1, 0.01, tissue={"elements_xyz": (4, 4, 1)})
    plain = preoperative_plans([small], step_m=0.02)[0]
    rng = np.random.default_rng(0)
    robust = preoperative_plans([small], step_m=0.02, samples=1, rng=rng)[0]
    assert robust.force_median_n == pytest.approx(plain.force_median_n, rel=1e-2)
    assert same_outcomes(robust.executions, plain.executions)
    with pytest.raises(ValueError, match="needs a random generator"):
        preoperative_plans([small], samples=1)
