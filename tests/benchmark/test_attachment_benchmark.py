"""Updates that estimators are compared on: what is drawn, when they are asked for, how they are
scored."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.benchmark.attachment_cases import (
    HIDDEN,
    OF_ATTACHMENTS,
    UpdateCase,
    draw_update,
    otherwise_wrong,
)
from defras_bt.benchmark.attachment_driver import Asked
from defras_bt.benchmark.attachment_runs import asked_update
from defras_bt.benchmark.attachment_summary import summed_up, torn_down
from defras_bt.benchmark.attachments import NOBODY, ORACLE, run_updates
from defras_bt.benchmark.retraction import Row
from defras_sim.effects.layers import Layers
from defras_sim.worlds.bullet_effects import in_bullet
from defras_sim.worlds.error import CannotImitate

SEED = 90_001


@pytest.fixture(scope="module")
def case() -> UpdateCase:
    return draw_update("fewer", SEED)


@pytest.fixture(scope="module")
def asked(case: UpdateCase) -> Asked:
    found = asked_update(case, "model")
    assert found is not None
    return found


@pytest.mark.parametrize("hidden", HIDDEN)
def test_what_is_believed_knows_nothing_of_what_is_hidden(hidden: str) -> None:
    case = draw_update(hidden, 3)
    assert draw_update(hidden, 3) == case
    assert case.believed.model.effects == ()
    same = np.array_equal(case.believed.attached, case.actual.attached)
    assert same == (hidden not in OF_ATTACHMENTS)
    assert (case.second_tool is not None) == (hidden == "second_tool")
    if case.second_tool is not None:
        assert case.second_tool.arm not in case.believed.arms
        assert case.second_tool.arm in case.actual.arms


def test_what_is_hidden_in_pybullet_is_what_its_tissue_can_have() -> None:
    """A patient of each kind can be set up there; stiff spots are for the model world only."""
    cases = otherwise_wrong(SEED, 2, "bullet")
    assert [number for _, number in cases] == [SEED] * 3 + [SEED + 1] * 3
    for hidden, number in cases:
        actual = draw_update(hidden, number).actual
        in_bullet(actual, Layers.of(actual.model.extension))
    spot = draw_update("stiffness", SEED).actual
    with pytest.raises(CannotImitate, match="inclusion"):
        in_bullet(spot, Layers.of(spot.model.extension))
    assert {hidden for hidden, _ in otherwise_wrong(SEED, 1, "model")} == (
        set(HIDDEN) - set(OF_ATTACHMENTS)
    )


def test_an_update_is_asked_for_when_monitoring_warns(case: UpdateCase, asked: Asked) -> None:
    assert asked.mu_m["local"] > 0.5 * case.believed.thresholds.delta_m[case.state - 1]
    assert len(asked.keyframes) >= 3
    np.testing.assert_array_equal(asked.belief.attached, case.believed.attached)
    assert asked.true_force_n > 0
    last = asked.keyframes[-1]
    travelled_m = np.linalg.norm(
        last.tips[case.arm].position_m - last.grasp_tips[case.arm].position_m
    )
    assert travelled_m > 0.003


def test_every_estimator_answers_on_the_same_update(asked: Asked) -> None:
    """The actual attachments bring the twin back; the belief does not."""
    rows = {
        row.run: row.values for row in run_updates([("fewer", SEED)], ["chain"], "model", jobs=1)
    }
    assert set(rows) == {"chain", ORACLE, NOBODY}
    assert rows[ORACLE]["f1"] == 1.0
    assert rows[ORACLE]["mu_local_mm"] < rows[NOBODY]["mu_local_mm"]
    assert rows[ORACLE]["surface_median_mm"] < 0.5
    assert rows[ORACLE]["force_error"] < 0.15
    assert rows["chain"]["cpu_s"] > 0
    assert rows["chain"]["mu_local_mm"] <= rows[NOBODY]["mu_local_mm"] + 0.1
    count, said, holds = np.array(rows["chain"]["bins"])
    assert count.sum() == 144
    assert (said <= count + 1e-9).all()
    assert (holds <= count).all()


def test_cases_that_are_done_are_not_run_again() -> None:
    done = frozenset({f"fewer 5 fewer {NOBODY}"})
    assert list(run_updates([("fewer", 5)], ["chain"], "model", jobs=1, done=done)) == []


def row(case: str, run: str, **values: object) -> Row:
    said = {
        "asked": True,
        "adopted": True,
        "under_local": True,
        "under_median": True,
        "surface_median_mm": 0.1,
        "surface_95_mm": 1.0,
        "force_error": 0.05,
        "f1": 0.9,
        "changes_f1": 0.5,
        "near0": [4, 4, 2],
        "near1": [10, 20, 10],
        "near2": [0, 10, 0],
        "bins": [[50, 50], [5.0, 45.0], [10.0, 45.0]],
        "wall_s": 1.0,
        "cpu_s": 1.0,
        **values,
    }
    return Row(case, case.split()[0], run, said)


def test_shares_medians_and_calibration_are_those_of_the_rows() -> None:
    rows = [
        row("fewer 0", "chain"),
        row("more 1", "chain", adopted=False, under_local=False, force_error=None),
        row("fewer 2", "chain", asked=False),
        row("slip 0", "chain", adopted=False),
        row("camera 0", "chain", adopted=True),
    ]
    (line,) = summed_up(rows, ["chain"])
    assert line["updates"] == 2
    assert line["adopted"].startswith("50 (1 to 99")
    assert line["force [%]"].startswith("5.00")
    assert line["precision / recall, 0 to 30 mm"] == "0.50 / 0.50"
    assert line["precision / recall, 30 to 60 mm"] == "1.00 / 0.50"
    assert line["calibration"] == 0.05
    (wrong,) = torn_down(rows, ["chain"])
    assert wrong["slip"] == "0 of 1"
    assert wrong["camera"] == "1 of 1"
    assert wrong["wrongly adopted"].startswith("50")
