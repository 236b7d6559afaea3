"""Pushes of an arm as a problem."""

from pathlib import Path

import numpy as np
import pytest

from defras_bt.benchmark.hidden_tables import write_table
from defras_bt.diagnosis.twins.arm_load import ArmLoadProblem
from defras_bt.diagnosis.twins.tables import read_problem
from defras_sim.effects.arm_compliance import USUAL_REACH_M
from defras_sim.yaml_source import InvalidFile
from tests.diagnosis.arm_tables import joint_table

TRUTH = {"arm_compliance": {"x_m_per_n": 1e-3, "x_growth_per_n": 6e-3}}
REACHES_M = (0.11, 0.13, 0.15, 0.17, 0.19)


def push_table(
    folder: Path, reaches_m=REACHES_M, repeats: int = 3, axis: str = "x", noise_m: float = 0.0
) -> Path:
    rng = np.random.default_rng(8)
    columns: dict[str, list] = {"trajectory": [], "reach_m": []}
    names = [f"force_{axis}_N", f"tip_setpoint_{axis}_m", f"tip_measured_{axis}_m"]
    columns |= {name: [] for name in names}
    for reach_m in reaches_m:
        for repeat in range(repeats):
            force_n = np.concatenate([np.zeros(3), np.linspace(0.2, 3, 20)])
            told_m = np.linspace(0, -0.005, 23)
            compliance = 1e-3 + 6e-3 * (reach_m - USUAL_REACH_M)
            # The tracker's frame is another one in each repeat.
            seen_m = told_m + compliance * force_n + 1e-3 * rng.normal()
            seen_m = seen_m + noise_m * rng.normal(size=23)
            columns["trajectory"] += 23 * [f"{reach_m} {repeat}"]
            columns["reach_m"] += 23 * [reach_m]
            for name, values in zip(names, (force_n, told_m, seen_m), strict=True):
                columns[name] += list(values)
    return write_table(folder / f"push_{axis}.csv", columns)


def problem_of(*files: Path) -> ArmLoadProblem:
    problem = read_problem(files, "arm")
    assert isinstance(problem, ArmLoadProblem)
    return problem


def test_the_truth_leaves_nothing_wherever_the_tracker_stands(tmp_path):
    problem = problem_of(push_table(tmp_path))
    assert np.abs(problem.residual(TRUTH)).max() < 1e-12
    assert np.abs(problem.residual({})).max() > 5e-4


def test_repeats_at_one_reach_are_held_out_together(tmp_path):
    samples = problem_of(push_table(tmp_path)).samples
    assert len(samples.trajectories) == 15
    for fold in range(5):
        own = {samples.trajectories[t].split()[0] for t in samples.trajectory[samples.fold == fold]}
        assert len(own) == 1


def test_rows_before_the_tip_touches_are_left_out(tmp_path):
    problem = problem_of(push_table(tmp_path))
    assert len(problem.samples.time_s) == 15 * 20
    assert sum(problem.quality.left_out.values()) == 15 * 3
    assert "touches nothing yet" in problem.quality.faults[0].sentence


def test_growth_with_reach_is_asked_for_at_several_reaches_only(tmp_path):
    many = problem_of(push_table(tmp_path))
    assert [c.key for c in many.candidates] == ["arm_compliance@x", "arm_compliance@x,reach"]
    one = problem_of(push_table(tmp_path, reaches_m=(0.15,)))
    assert [c.key for c in one.candidates] == ["arm_compliance@x"]


def test_long_reaches_are_beyond_short_ones(tmp_path):
    problem = problem_of(push_table(tmp_path))
    near, far, line = problem.split_by_range()
    assert line == "a reach of 0.150 m"
    assert len(near.samples.trajectories) == 9
    assert len(far.samples.trajectories) == 6
    assert [c.key for c in near.candidates] == [c.key for c in far.candidates]
    assert problem_of(push_table(tmp_path, reaches_m=(0.1, 0.15))).split_by_range() is None


def test_joints_and_pushes_do_not_mix(tmp_path):
    joints = joint_table(tmp_path / "joints.csv", {}, np.random.default_rng(0), 50)
    with pytest.raises(InvalidFile, match="diagnose them apart"):
        read_problem([joints, push_table(tmp_path)], "arm")


def test_a_push_needs_its_columns(tmp_path):
    columns = {"force_x_N": np.arange(9.0), "reach_m": np.full(9, 0.1)}
    with pytest.raises(InvalidFile, match="no axis has force, set-point and measured tip"):
        read_problem([write_table(tmp_path / "t.csv", columns)], "arm")


def test_what_cannot_be_seen_is_refused(tmp_path):
    with pytest.raises(ValueError, match="joint_play cannot be seen in pushes"):
        problem_of(push_table(tmp_path)).residual({"joint_play": {"q5_rad": 0.1}})
