"""What the engine says of measured specimens; no code knows these files."""

from pathlib import Path

import numpy as np
import pytest

from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.twins.tables import read_problem
from tests.measured.measured_tables import elastomer_table, silicone_table


def test_the_elastomer_relaxes_and_not_linearly(measured_data: Path, tmp_path):
    tests = [f"relax_{stretch}" for stretch in ("1d5", "3d0", "6d0")]
    tables = [elastomer_table(tmp_path, measured_data, test, each=10) for test in tests]
    verdict = diagnose(read_problem(tables, "coupon"), np.random.default_rng(1)).verdict
    assert "stress_relaxation" in {cause.effect for cause in verdict.causes}
    assert any(
        remark.startswith("Linear viscoelasticity is not enough") for remark in verdict.warnings
    )


def test_what_fits_a_silicone_in_range_may_fail_beyond(measured_data: Path, tmp_path):
    problem = read_problem([silicone_table(tmp_path, measured_data, "mold_star_16_fast")], "coupon")
    verdict = diagnose(problem, np.random.default_rng(1)).verdict
    assert [cause.effect for cause in verdict.causes] == ["strain_stiffening"]
    assert verdict.gain.in_range is not None
    assert verdict.gain.in_range > 0.7
    assert verdict.gain.beyond_range is not None
    assert verdict.gain.beyond_range < 0
    assert any("do not extrapolate" in warning for warning in verdict.warnings)


@pytest.mark.parametrize("material", ["dragon_skin_20", "platsil_gel_10", "soloplast_150318"])
def test_a_silicone_that_no_law_here_describes_is_not_forced_into_one(
    measured_data: Path, tmp_path, material
):
    problem = read_problem([silicone_table(tmp_path, measured_data, material)], "coupon")
    verdict = diagnose(problem, np.random.default_rng(1)).verdict
    assert verdict.verdict in ("outside", "named")
    gain = verdict.gain
    if verdict.causes:
        assert gain.in_range is not None
        assert gain.in_range > 0.5
    if gain.beyond_range is not None and gain.beyond_range < 0:
        assert any("do not extrapolate" in warning for warning in verdict.warnings)


def test_where_it_holds_beyond_the_range_nothing_is_warned_of(measured_data: Path, tmp_path):
    problem = read_problem([silicone_table(tmp_path, measured_data, "bodydouble_silk")], "coupon")
    verdict = diagnose(problem, np.random.default_rng(1)).verdict
    assert verdict.gain.beyond_range is not None
    assert verdict.gain.beyond_range > 0.5
    assert not any("do not extrapolate" in warning for warning in verdict.warnings)
