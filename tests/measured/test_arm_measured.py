"""What the engine says of measured arms; no code knows these files."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.settings import Settings
from defras_bt.diagnosis.twins.table_problem import TableProblem
from defras_bt.diagnosis.twins.tables import read_problem
from defras_sim.effects.effect import Values
from tests.measured.measured_tables import cable_table, load_table, motion_table

WRIST = ("q4", "q5", "q6")


def diagnosed(problem: TableProblem, causes: int = 16) -> Diagnosis:
    return diagnose(problem, np.random.default_rng(1), settings=Settings(causes=causes))


def named(diagnosis: Diagnosis) -> set[str]:
    return {f"{cause.effect}@{cause.site}" for cause in diagnosis.verdict.causes}


def rms(problem: TableProblem, model: Mapping[str, Values]) -> dict[str, float]:
    residual = problem.residual(model)
    samples = problem.samples
    return {
        channel.name: float(np.sqrt(np.nanmean(residual[samples.channel == i] ** 2)))
        for i, channel in enumerate(samples.channels)
    }


def test_cables_have_play_and_no_coupling_from_the_first_joints(measured_data: Path, tmp_path):
    part = slice(0, 1500)
    fitted = read_problem([cable_table(tmp_path, measured_data, "random", WRIST, part)], "arm")
    unseen = read_problem([cable_table(tmp_path, measured_data, "peg", WRIST)], "arm")
    diagnosis = diagnosed(fitted)
    found = named(diagnosis)
    assert diagnosis.verdict.verdict == "named"
    assert {"joint_play@q5", "joint_play@q6"} <= found
    assert not any(key.endswith("<-q1,q2,q3") for key in found)
    before, after = rms(unseen, {}), rms(unseen, diagnosis.model)
    # With offsets and linear coupling alone: 1.7, 7.5, 5.4 degrees.
    assert np.rad2deg([before[q] for q in WRIST]) == pytest.approx([9.5, 10.9, 15.1], abs=0.1)
    assert np.rad2deg(after["q4"]) < 1.35
    assert np.rad2deg(after["q5"]) < 3.35
    assert np.rad2deg(after["q6"]) < 2.45


def test_a_camera_that_saw_nothing_wrote_zeros(measured_data: Path, tmp_path):
    problem = read_problem([cable_table(tmp_path, measured_data, "exp1", WRIST)], "arm")
    (fault,) = (f for f in problem.quality.faults if f.kind == "zeros")
    assert fault.rows == 4
    assert fault.spans_s[0] == (pytest.approx(129.54, abs=0.1), pytest.approx(131.37, abs=0.1))


def test_across_the_shaft_compliance_grows_with_reach(measured_data: Path, tmp_path):
    problem = read_problem([load_table(tmp_path, measured_data, "x")], "arm")
    diagnosis = diagnosed(problem)
    assert named(diagnosis) == {"arm_compliance@x", "arm_compliance@x,reach"}
    held_out = diagnosis.held_out_after
    assert np.sqrt(np.nanmean(held_out**2)) < 0.11e-3
    assert np.sqrt(np.nanmean(diagnosis.held_out_before**2)) > 0.8e-3
    assert diagnosis.verdict.gain.in_range is not None
    assert diagnosis.verdict.gain.in_range > 0.95


def test_along_the_shaft_it_does_not(measured_data: Path, tmp_path):
    problem = read_problem([load_table(tmp_path, measured_data, "z")], "arm")
    assert named(diagnosed(problem)) == {"arm_compliance@z"}


def test_servos_are_late(measured_data: Path, tmp_path):
    joints = ("q1", "q2", "q3")
    table = motion_table(tmp_path, measured_data, joints)
    diagnosis = diagnosed(read_problem([table], "arm"))
    assert {f"servo_lag@{q}" for q in joints} <= named(diagnosis)
    lags = {
        cause.site: cause.parameters[f"{cause.site}_s"].value
        for cause in diagnosis.verdict.causes
        if cause.effect == "servo_lag"
    }
    assert 0.045 < lags["q1"] < 0.055
    assert 0.045 < lags["q2"] < 0.055
    # Dry friction of the insertion, where it is named beside, takes its part of the lateness.
    assert 0.035 < lags["q3"] < 0.055
    assert diagnosis.verdict.gain.in_range is not None
    assert diagnosis.verdict.gain.in_range > 0.98
