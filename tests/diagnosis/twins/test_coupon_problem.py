"""A specimen's tables as a problem."""

from pathlib import Path

import numpy as np
import pytest

from defras_bt.benchmark.hidden_tables import write_table
from defras_bt.diagnosis.twins.coupon import CouponProblem
from defras_bt.diagnosis.twins.table_problem import added, moved
from defras_bt.diagnosis.twins.tables import read_problem
from defras_sim.geometry import Floats
from defras_sim.yaml_source import InvalidFile
from tests.diagnosis.arm_tables import pull_table

TRUTH = {
    "strain_stiffening": {"coefficient": 0.2},
    "softening": {"share": 0.3, "width": 0.5},
    "stress_relaxation": {"fraction": 0.4, "time_s": 8.0},
}
CYCLE = np.concatenate([np.linspace(1, 2, 80), np.full(80, 2.0), np.linspace(2, 1, 80)])


def ramp_and_hold(stretch: float, ramp: int, hold: int) -> Floats:
    return np.concatenate([np.linspace(1, stretch, ramp), np.full(hold, stretch)])


def problem_of(*files: Path) -> CouponProblem:
    problem = read_problem(files, "coupon")
    assert isinstance(problem, CouponProblem)
    return problem


def pulled(folder: Path, model: dict, stretch: Floats, noise_n: float = 0.0) -> CouponProblem:
    return problem_of(
        pull_table(folder / "p.csv", model, np.random.default_rng(4), stretch, noise_n)
    )


def test_the_truth_leaves_nothing_once_the_modulus_is_fitted(tmp_path):
    problem = pulled(tmp_path, TRUTH, CYCLE)
    model = {"stiffness": {"scale": 20e3 / problem.young_modulus_pa}, **TRUTH}
    assert np.abs(problem.residual(model)).max() < 1e-12
    base = [c.key for c in problem.candidates if c.base]
    assert base == ["stiffness"]


def test_a_plain_specimen_has_its_modulus(tmp_path):
    assert pulled(tmp_path, {}, CYCLE).young_modulus_pa == pytest.approx(20e3)


@pytest.mark.parametrize("model", [{}, TRUTH], ids=["null", "truth"])
def test_tangents_say_how_predictions_change(tmp_path, model):
    problem = pulled(tmp_path, TRUTH, CYCLE)
    for candidate in problem.candidates:
        for tangent in problem.tangents(model, candidate):
            here = problem.predicted(added(model, candidate.effect, tangent.at))
            for step, column in zip(tangent.steps, tangent.columns.T, strict=True):
                small = {name: 1e-3 * change for name, change in step.items()}
                there = problem.predicted(added(model, candidate.effect, moved(tangent.at, small)))
                scale = np.abs(column).max()
                assert (there - here) / 1e-3 == pytest.approx(column, abs=0.02 * scale + 1e-12)


def test_softening_is_asked_for_only_where_something_was_let_go(tmp_path):
    keys = {c.key for c in pulled(tmp_path, {}, CYCLE[:160]).candidates}
    assert "softening" not in keys
    assert "softening" in {c.key for c in pulled(tmp_path, {}, CYCLE).candidates}


def test_beyond_the_range_the_past_still_counts(tmp_path):
    problem = pulled(tmp_path, TRUTH, CYCLE)
    below, above, line = problem.split_by_range()
    assert line == "a stretch of 1.60"
    assert (np.isfinite(below.measured) ^ np.isfinite(above.measured)).all()
    assert np.nanmax(np.where(np.isfinite(below.measured), CYCLE, 0)) <= 1.6
    assert np.array_equal(below.predicted(TRUTH), problem.predicted(TRUTH))


def test_a_short_table_is_not_split(tmp_path):
    assert pulled(tmp_path, {}, np.linspace(1, 2, 30)).split_by_range() is None


def two_holds(folder: Path, fractions: tuple[float, float]) -> CouponProblem:
    rng = np.random.default_rng(4)
    files = []
    for stretch, fraction, ramp in ((1.3, fractions[0], 8), (2.5, fractions[1], 40)):
        model = {"stress_relaxation": {"fraction": fraction, "time_s": 60.0}}
        rows = ramp_and_hold(stretch, ramp, 800)
        files.append(pull_table(folder / f"{stretch}.csv", model, rng, rows, 1e-5))
    return problem_of(*files)


def test_relaxation_that_depends_on_stretch_is_remarked_on(tmp_path):
    said = {"stress_relaxation": {"fraction": 0.5, "time_s": 60.0}}
    (remark,) = two_holds(tmp_path, (0.6, 0.4)).remarks(said)
    assert remark.startswith("Linear viscoelasticity is not enough")
    assert "stretch of 1.30" in remark
    assert "at 2.50" in remark


def test_relaxation_that_does_not_is_not_however_long_the_stretching_took(tmp_path):
    said = {"stress_relaxation": {"fraction": 0.5, "time_s": 60.0}}
    problem = two_holds(tmp_path, (0.5, 0.5))
    assert problem.remarks(said) == []
    # Nor does a wrong model make it so.
    assert problem.remarks({}) == []


def test_strain_for_stretch_and_a_changing_section_are_refused(tmp_path):
    columns = {
        "time_s": np.arange(30.0),
        "stretch": np.linspace(0, 1, 30),
        "force_N": np.linspace(0, 1, 30),
        "area_m2": np.full(30, 1e-5),
    }
    with pytest.raises(InvalidFile, match="1 at rest: strain or percent need to be converted"):
        problem_of(write_table(tmp_path / "t.csv", columns))
    columns["stretch"] = 1 + columns["stretch"]
    columns["area_m2"] = np.linspace(1e-5, 2e-5, 30)
    with pytest.raises(InvalidFile, match="area_m2 should be one positive number"):
        problem_of(write_table(tmp_path / "t.csv", columns))


def test_forces_that_are_missing_are_left_out_but_the_stretch_is_remembered(tmp_path):
    file = pull_table(tmp_path / "p.csv", TRUTH, np.random.default_rng(4), CYCLE, 0.0)
    lines = file.read_text().splitlines()
    for row in (50, 51, 52):
        cells = lines[row].split(",")
        lines[row] = ",".join([*cells[:2], "", cells[3]])
    file.write_text("\n".join(lines))
    problem = problem_of(file)
    assert problem.quality.left_out == {"p force": 3}
    assert int(np.isnan(problem.measured).sum()) == 3
    model = {"stiffness": {"scale": 20e3 / problem.young_modulus_pa}, **TRUTH}
    assert np.nanmax(np.abs(problem.residual(model))) < 1e-12
