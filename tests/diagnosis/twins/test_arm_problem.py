"""The arm's tables as a problem: what is compared, what is left out, how predictions change."""

from pathlib import Path

import numpy as np
import pytest

from defras_bt.benchmark.hidden_tables import joint_columns, random_joints, write_table
from defras_bt.diagnosis.layout import layout
from defras_bt.diagnosis.twins.arm import ArmProblem
from defras_bt.diagnosis.twins.table_problem import added, moved
from defras_bt.diagnosis.twins.tables import read_problem
from defras_sim.yaml_source import InvalidFile
from tests.diagnosis.arm_tables import joint_table

TRUTH = {
    "joint_play": {"q6_rad": 0.2, "q6_share": 0.6, "q5_dragged_by_q6": 0.4},
    "joint_coupling": {"q6_from_q5": 0.1},
    "servo_lag": {"q1_s": 0.05},
    "joint_offset": {"q4_rad": 0.1},
}


def problem_of(*files: Path) -> ArmProblem:
    problem = read_problem(files, "arm")
    assert isinstance(problem, ArmProblem)
    return problem


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> ArmProblem:
    folder = tmp_path_factory.mktemp("tables")
    rng = np.random.default_rng(2)
    return problem_of(
        joint_table(folder / "one.csv", TRUTH, rng, 300, noise=0.0),
        joint_table(folder / "two.csv", TRUTH, rng, 200, noise=0.0),
    )


def test_the_truth_leaves_nothing(problem):
    assert np.abs(problem.residual(TRUTH)).max() < 1e-12
    assert np.abs(problem.residual({})).max() > 0.05


def test_samples_are_labelled_in_order(problem):
    samples = problem.samples
    assert samples.trajectories == ("one", "two")
    assert [c.name for c in samples.channels] == ["q1", "q2", "q3", "q4", "q5", "q6"]
    found = layout(samples)
    assert [s.length for s in found.series] == 6 * [300] + 6 * [200]
    # Stretches of a trajectory are held out together, in all joints at once.
    assert len(np.unique(samples.fold)) == 6
    for trajectory in (0, 1):
        own = samples.trajectory == trajectory
        by_joint = samples.fold[own].reshape(6, -1)
        assert (by_joint == by_joint[0]).all()
        assert (np.diff(by_joint[0]) >= 0).all()


@pytest.mark.parametrize("model", [{}, TRUTH], ids=["null", "truth"])
def test_tangents_say_how_predictions_change(problem, model):
    for candidate in problem.candidates:
        for tangent in problem.tangents(model, candidate):
            here = problem.predicted(added(model, candidate.effect, tangent.at))
            for step, column in zip(tangent.steps, tangent.columns.T, strict=True):
                # From the null point of a nonlinear effect only whole secants hold.
                secant = len(problem.tangents(model, candidate)) > 1
                share = 1.0 if secant else 1e-3
                small = {name: share * change for name, change in step.items()}
                there = problem.predicted(added(model, candidate.effect, moved(tangent.at, small)))
                wrong = np.abs((there - here) / share - column)
                # Play has kinks, where differences of two sizes differ; they are few.
                assert np.quantile(wrong, 0.99) <= 0.02 * np.abs(column).max() + 1e-8


def test_secants_begin_where_nothing_is_changed_yet(problem):
    for candidate in problem.candidates:
        for tangent in problem.tangents({}, candidate):
            at = problem.predicted(added({}, candidate.effect, tangent.at))
            assert np.array_equal(at, problem.predicted({}))


def test_a_joint_that_rests_shows_neither_lag_nor_play(tmp_path):
    time_s, setpoint = random_joints(np.random.default_rng(0), 100)
    setpoint[:, 4] = 0.2
    columns = joint_columns(time_s, setpoint, setpoint)
    keys = {c.key for c in problem_of(write_table(tmp_path / "t.csv", columns)).candidates}
    assert "joint_offset@q5" in keys
    assert not keys & {"servo_lag@q5", "joint_play@q5"}
    assert "joint_coupling@q6<-q4,q6" in keys


def test_only_measured_joints_are_compared(tmp_path):
    time_s, setpoint = random_joints(np.random.default_rng(0), 100)
    columns = joint_columns(time_s, setpoint, setpoint)
    for joint in ("q1", "q2", "q4", "q5"):
        del columns[f"{joint}_measured_rad"]
    problem = problem_of(write_table(tmp_path / "t.csv", columns))
    assert [c.name for c in problem.samples.channels] == ["q3", "q6"]
    assert not any("q5" in c.site.split("<-")[0] for c in problem.candidates)


def test_bad_rows_are_found_told_and_left_out(tmp_path):
    time_s, setpoint = random_joints(np.random.default_rng(0), 100)
    measured = setpoint.copy()
    measured[10:12, 3:] = 0.0
    measured[20, 1] = np.nan
    time_s[30] = time_s[29]
    time_s[50:] += 5.0
    columns = joint_columns(time_s, setpoint, measured)
    problem = problem_of(write_table(tmp_path / "t.csv", columns))
    found = {fault.kind: fault for fault in problem.quality.faults}
    assert set(found) == {"zeros", "not_finite", "time_backwards", "drop_out"}
    assert found["zeros"].rows == 2
    assert found["zeros"].spans_s == ((pytest.approx(1.0), pytest.approx(1.1)),)
    assert found["drop_out"].spans_s == ((pytest.approx(4.9), pytest.approx(10.0)),)
    assert sum(problem.quality.left_out.values()) == 4
    # A row that was not seen was commanded all the same: the joints remember it.
    assert len(problem.samples.time_s) == 6 * 99
    assert int(np.isnan(problem.residual({})).sum()) == 6 * 3


def test_degrees_under_a_header_of_radians_are_suspected(tmp_path):
    time_s, setpoint = random_joints(np.random.default_rng(0), 100)
    columns = joint_columns(time_s, setpoint, setpoint)
    columns["q5_measured_rad"] = np.rad2deg(columns["q5_measured_rad"])
    problem = problem_of(write_table(tmp_path / "t.csv", columns))
    (fault,) = problem.quality.faults
    assert (fault.kind, fault.rows) == ("unit", 100)
    assert "degrees" in fault.sentence
    assert "q5" not in [c.name for c in problem.samples.channels]
    columns["q5_setpoint_rad"] = np.rad2deg(columns["q5_setpoint_rad"])
    with pytest.raises(InvalidFile, match="'_deg'"):
        problem_of(write_table(tmp_path / "t.csv", columns))


def test_noise_is_what_the_table_says_or_what_rows_scatter(tmp_path):
    rng = np.random.default_rng(3)
    time_s, setpoint = random_joints(rng, 2000)
    measured = setpoint + 0.003 * rng.normal(size=setpoint.shape)
    columns = joint_columns(time_s, setpoint, measured)
    columns["q6_measured_sd_rad"] = np.full(2000, 0.01)
    channels = problem_of(write_table(tmp_path / "t.csv", columns)).samples.channels
    assert channels[4].noise_sd == pytest.approx(0.003, rel=0.1)
    assert channels[5].noise_sd == pytest.approx(0.01)


def test_a_table_without_measured_joints_says_what_is_needed(tmp_path):
    time_s, setpoint = random_joints(np.random.default_rng(0), 20)
    columns = joint_columns(time_s, setpoint, np.full_like(setpoint, np.nan))
    with pytest.raises(InvalidFile, match="no joint was measured"):
        problem_of(write_table(tmp_path / "t.csv", columns))
