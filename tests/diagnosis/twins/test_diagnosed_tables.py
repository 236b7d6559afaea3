"""Tables with a hidden cause, diagnosed from end to end."""

from pathlib import Path

import numpy as np
import pytest

from defras_bt.benchmark.hidden_tables import (
    arm_table,
    joint_columns,
    random_joints,
    remembering,
    write_table,
)
from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.twins.tables import read_problem
from defras_sim.arm.true_joints import true_joints
from defras_sim.effects.effect import Extension
from tests.diagnosis.arm_tables import JOINT_NOISE, pull_table


def wrist_diagnosed(folder: Path, model: Extension, seed: int, known: bool = True) -> Diagnosis:
    """An arm of which wrist pitch and yaw were seen, with slowly drifting errors of 2 mrad,
    ``known`` or to be told from what changes from row to row."""
    rng = np.random.default_rng(seed)
    time_s, setpoint = random_joints(rng, 500)
    seen = true_joints(model, time_s, setpoint) + JOINT_NOISE * remembering(rng, 500, 6, 0.95)
    seen[:, :4] = np.nan
    columns = joint_columns(time_s, setpoint, seen)
    for joint in ("q1", "q2", "q4"):
        del columns[f"{joint}_measured_rad"]
    del columns["q3_measured_m"]
    for joint in ("q5", "q6") if known else ():
        columns[f"{joint}_measured_sd_rad"] = np.full(500, 2e-3)
    problem = read_problem([write_table(folder / "wrist.csv", columns)], "arm")
    return diagnose(problem, rng)


def specimen_diagnosed(folder: Path, model: Extension, seed: int) -> Diagnosis:
    rng = np.random.default_rng(seed)
    up, down = np.linspace(1, 2, 60), np.linspace(2, 1, 60)
    stretch = np.concatenate([up, np.full(60, 2.0), down, up, down])
    return diagnose(
        read_problem([pull_table(folder / "p.csv", model, rng, stretch)], "coupon"), rng
    )


def keys(diagnosis: Diagnosis) -> list[str]:
    return [f"{c.effect}@{c.site}" if c.site else c.effect for c in diagnosis.verdict.causes]


def test_a_free_gap_is_named_with_its_width(tmp_path):
    diagnosis = wrist_diagnosed(tmp_path, {"joint_play": {"q5_rad": 0.05}}, 1)
    assert diagnosis.verdict.verdict == "named"
    assert keys(diagnosis) == ["joint_play@q5"]
    (cause,) = diagnosis.verdict.causes
    low, high = cause.parameters["q5_rad"].interval90
    assert low <= 0.05 <= high
    assert high - low < 0.03
    assert diagnosis.verdict.gain.in_range is not None
    assert diagnosis.verdict.gain.in_range > 0.8


def test_a_late_joint_is_not_taken_for_a_loose_one(tmp_path):
    diagnosis = wrist_diagnosed(tmp_path, {"servo_lag": {"q6_s": 0.04}}, 2)
    assert keys(diagnosis) == ["servo_lag@q6"]
    low, high = diagnosis.verdict.causes[0].parameters["q6_s"].interval90
    assert low <= 0.04 <= high


def test_where_nothing_is_wrong_nothing_is_named_and_play_is_excluded(tmp_path):
    diagnosis = wrist_diagnosed(tmp_path, {}, 3)
    assert diagnosis.verdict.verdict == "nothing"
    excluded = diagnosis.verdict.excluded["joint_play@q5"]
    assert excluded.unit == "rad"
    assert excluded.strength < 0.05


@pytest.mark.parametrize("seed", [3058, 3135, 3150])
def test_shares_of_lost_motion_do_not_let_play_foretell_the_folds_they_were_fitted_to(
    tmp_path: Path, seed: int
) -> None:
    """Noise in which play of some width, with shares that suit all of it, looks like more than
    chance; tuned without a fold, they do not foretell it."""
    rng = np.random.default_rng([seed, *f"nothing arm nothing {seed}".encode()])
    file = tmp_path / "measured.csv"
    arm_table(file, {}, rng)
    diagnosis = diagnose(read_problem([file], "arm"), np.random.default_rng(seed))
    tried = [trial for each in diagnosis.rounds for trial in each.trials]
    assert any(trial.key.startswith("joint_play") for trial in tried)
    assert diagnosis.verdict.verdict == "nothing"


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("stress_relaxation", {"fraction": 0.4, "time_s": 8.0}),
        ("softening", {"share": 0.4, "width": 0.5}),
    ],
)
def test_material_laws_are_told_apart(tmp_path, effect, values):
    diagnosis = specimen_diagnosed(tmp_path, {effect: values}, 5)
    assert keys(diagnosis) == [effect]
    for name, truth in values.items():
        found = diagnosis.verdict.causes[0].parameters[name]
        low, high = found.interval90
        # Twice the interval: one in ten misses the simple one.
        assert abs(found.value - truth) < high - low
        assert high - low < 0.1 * truth


def test_readings_that_drift_more_than_they_are_known_to_are_something_unknown(tmp_path):
    diagnosis = wrist_diagnosed(tmp_path, {}, 3, known=False)
    assert not diagnosis.verdict.causes
    assert diagnosis.verdict.verdict == "outside"


def test_a_plain_specimen_is_plain_whatever_its_modulus(tmp_path):
    assert specimen_diagnosed(tmp_path, {}, 5).verdict.verdict == "nothing"
