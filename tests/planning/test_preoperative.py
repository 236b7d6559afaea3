"""The plan made before the operation, and its file."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from defras_bt.planning.choice import choose
from defras_bt.planning.engine import Engine
from defras_bt.planning.plan_file import (
    InvalidPlanFile,
    StalePlanFile,
    UnusableThreshold,
    load_plan,
    save_plan,
)
from defras_bt.planning.preoperative import NothingToRetract, preoperative_plan, preoperative_plans
from defras_bt.planning.scene_hash import scene_hash
from tests.planning.conftest import make_scene, same_outcomes

STEP_M = 0.01
ALONE = Engine(jobs=1)


def test_a_region_that_is_visible_already_is_said_so():
    scene = make_scene(1, 1, 0.03, tissue={"elements_xyz": (4, 4, 1), "thickness_m": 0.001})
    roi = scene.roi.model_copy(update={"center_x_m": -0.057, "radius_m": 0.003})
    limits = scene.thresholds.model_copy(update={"roi_visibility": 0.05})
    seen = scene.model_copy(update={"roi": roi, "thresholds": limits})
    with pytest.raises(NothingToRetract, match=r"\d+% of the region is visible before"):
        preoperative_plan(seen, engine=ALONE)


@pytest.fixture(scope="module")
def small():
    """Two grasp points on a coarse tissue."""
    return make_scene(2, 1, 0.01, tissue={"elements_xyz": (4, 4, 1)})


@pytest.fixture(scope="module")
def rehearsed(small):
    ticks = []
    result = preoperative_plan(
        small, engine=ALONE, step_m=STEP_M, progress=lambda *tick: ticks.append(tick)
    )
    return result, ticks


def test_executions_threshold_and_progress(small, rehearsed):
    result, ticks = rehearsed
    assert ticks == [(0, 2), (1, 2), (2, 2)]
    assert {e.point for e in result.executions} == {(1, 1), (2, 1)}
    keys = [(e.point, e.manoeuvres) for e in result.executions]
    assert len(keys) == len(set(keys)) <= 8
    forces_n = [e.force_max_n for e in result.executions]
    assert result.force_median_n == np.median(forces_n)
    assert result.force_threshold_n == 2 * result.force_median_n


def test_the_plan_follows_the_choice(small, rehearsed):
    result, _ = rehearsed
    chosen = choose(result.executions, 0.8, result.force_threshold_n)
    assert result.chosen == chosen
    names = [action.name for action in result.plan.actions]
    if chosen is None:
        assert result.plan.source == "asp"
        assert "grasp-point optimisation prefers" in result.reason
    else:
        assert result.plan.source == "preoperative"
        assert names[3:] == list(chosen.manoeuvres)
        assert result.plan.actions[0].point == chosen.point


def with_thresholds(scene, **changes):
    return scene.model_copy(update={"thresholds": scene.thresholds.model_copy(update=changes)})


def test_threshold_of_the_scene_counts_and_nothing_qualifies(small):
    strict = with_thresholds(small, force_n=1e-6)
    result = preoperative_plan(strict, engine=ALONE, step_m=STEP_M)
    assert result.force_threshold_n == 1e-6
    assert result.chosen is None
    assert result.plan.source == "asp"
    assert result.plan.proved_shortest
    assert result.reason.endswith("the plan is the one that the grasp-point optimisation prefers")


def test_jobs_change_nothing_and_scenes_pool(small, rehearsed):
    """Of two scenes, one of them with stiffer tissue, epsilon comes from all rehearsals."""
    stiff = small.model_copy(
        update={"tissue": small.tissue.model_copy(update={"young_modulus_pa": 6000.0})}
    )
    one, other = preoperative_plans([small, stiff], engine=Engine(jobs=2), step_m=STEP_M)
    assert same_outcomes(one.executions, rehearsed[0].executions)
    forces_n = [e.force_max_n for result in (one, other) for e in result.executions]
    assert one.force_threshold_n == other.force_threshold_n == 2 * np.median(forces_n)


@pytest.mark.parametrize("written", ["NaN", "Infinity", '"inf"', "-1", "0", "1e9"])
def test_a_threshold_that_is_no_sensible_force_is_refused(small, rehearsed, tmp_path, written):
    file = tmp_path / "plan.json"
    save_plan(rehearsed[0], file)
    plain = file.read_text()
    limit_n = json.loads(plain)["result"]["force_threshold_n"]
    file.write_text(
        plain.replace(f'"force_threshold_n": {limit_n}', f'"force_threshold_n": {written}')
    )
    assert file.read_text() != plain
    with pytest.raises(InvalidPlanFile, match=r"force_threshold_n is .*above 0 N and up to 50 N"):
        load_plan(file, small)


@pytest.mark.parametrize("limit_n", [0.0, -1.0, 50.1, float("inf"), float("nan")])
def test_a_threshold_that_could_not_be_read_again_is_not_saved(rehearsed, tmp_path, limit_n):
    file = tmp_path / "plan.json"
    with pytest.raises(UnusableThreshold, match=r"above 0 N and up to 50 N.*thresholds.force_n"):
        save_plan(replace(rehearsed[0], force_threshold_n=limit_n), file)
    assert not file.exists()


def test_plan_file_round_trip(small, rehearsed, tmp_path):
    file = tmp_path / "plan.json"
    save_plan(rehearsed[0], file)
    assert load_plan(file, small) == rehearsed[0]
    renamed = small.model_copy(update={"name": "other", "description": "same content"})
    assert load_plan(file, renamed) == rehearsed[0]


@pytest.mark.parametrize(
    "changes",
    [
        {"force_n": 0.3},
        {"roi_visibility": 0.7},
    ],
)
def test_stale_plan_file(small, rehearsed, tmp_path, changes):
    file = tmp_path / "plan.json"
    save_plan(rehearsed[0], file)
    with pytest.raises(StalePlanFile, match="plan again"):
        load_plan(file, with_thresholds(small, **changes))


def test_hash_sees_attachments_but_not_sensors(small):
    moved = small.with_attached(~small.attached)
    noisy = small.model_copy(
        update={"depth_camera": small.depth_camera.model_copy(update={"noise_sd_m": 0.01})}
    )
    assert scene_hash(moved) != scene_hash(small)
    assert scene_hash(noisy) == scene_hash(small)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "the file: Invalid JSON"),
        ('{"schema": "defras/preoperative/2", "result": {}}', "schema: Input should be"),
        ('{"schema": "defras/preoperative/1", "result": {}}', "result.scene: Field required"),
    ],
)
def test_invalid_plan_file(small, tmp_path, content, message):
    file = tmp_path / "plan.json"
    file.write_text(content)
    with pytest.raises(InvalidPlanFile, match=message):
        load_plan(file, small)
