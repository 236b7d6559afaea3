from dataclasses import replace

import numpy as np

from defras_bt.benchmark import tissue_paths
from defras_bt.benchmark.tissue_paths import (
    MATERIALS,
    STEP_M,
    PathResult,
    failures,
    random_scene,
    run_path,
    run_paths,
    summary,
)
from defras_sim.tissue.model import TissueModel


def test_random_paths_are_solved_or_told_to_be_stale():
    told = []
    results = run_paths(30, seed=5, elements_xyz=(4, 4, 1), steps=12, told=told.append)
    assert results == told
    assert [result.path for result in results] == list(range(30))
    assert {result.material for result in results} == set(MATERIALS)
    all_of_them = summary(results)
    assert all_of_them.steps == 30 * 12
    assert all_of_them.untrue == 0
    assert all_of_them.errors == 0
    assert all_of_them.converged >= 0.995


def test_a_path_depends_on_its_seed_only():
    first, again, other = (run_path(seed, 3, (3, 3, 1), 5) for seed in (1, 1, 2))
    assert (first.force_n, first.iterations) == (again.force_n, again.iterations)
    assert first.force_n != other.force_n


def test_paths_step_evenly_and_turn(monkeypatch):
    rng = np.random.default_rng(0)
    start = tissue_paths.Pose(np.array([0.01, 0.02, 0.0]))
    way = list(tissue_paths._random_way(rng, start, 60))
    places = np.array([start.position_m, *(pose.position_m for pose in way)])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert np.all(steps <= STEP_M + 1e-12)
    assert np.median(steps) > 0.99 * STEP_M
    assert np.linalg.norm(places - start.position_m, axis=1).max() <= 0.06 + 1e-9
    assert places[:, 2].min() >= 0
    assert max(np.abs(pose.rotation - np.eye(3)).max() for pose in way) > 0.1


def test_every_random_scene_holds_somewhere():
    for seed in range(50):
        assert random_scene(np.random.default_rng(seed)).attached.any()


def test_stale_and_untrue_steps_are_counted(monkeypatch):
    solve = TissueModel.solve
    count = 0

    def failing(model, tips):
        nonlocal count
        count += 1
        state = solve(model, tips)
        changes = {"converged": False} if count == 2 else {}
        if count == 3:
            changes = {"strain_energy_j": np.nan}
        return tissue_paths.TissueState(**{**state.__dict__, **changes})

    monkeypatch.setattr(TissueModel, "solve", failing)
    result = run_path(0, 0, (3, 3, 1), 4)
    assert (result.stale, result.untrue, result.error) == (1, 1, None)
    assert summary([result]).converged == 0.75


def test_what_is_raised_is_told(monkeypatch):
    def broken(model, tips):
        raise ValueError("nothing goes")

    monkeypatch.setattr(TissueModel, "solve", broken)
    result = run_path(0, 0, (3, 3, 1), 4)
    assert result == PathResult(**{**result.__dict__, "error": "ValueError: nothing goes"})


def test_only_paths_that_failed_somewhere_are_listed() -> None:
    good = run_path(0, 0, (4, 4, 1), 2)
    stale = replace(good, path=7, stale=1)
    broken = replace(good, path=8, error="ValueError: x")
    assert [row["path"] for row in failures([good, stale, broken])] == [7, 8]
