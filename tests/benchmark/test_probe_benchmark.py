"""Whether a tug pays: what the arms of a case have in common, and what is made of their rows."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from defras_bt.benchmark.attachment_cases import FIRST_SEED, wrongly_believed
from defras_bt.benchmark.intervals import LEAST_PAIRS, Difference
from defras_bt.benchmark.probe import ARMS, BEFORE, GOES_ON, SURE, TUG, UNSAFE, run_probes
from defras_bt.benchmark.probe_motion import divided
from defras_bt.benchmark.probe_summary import compared, frequencies, run_rows, verdict
from defras_bt.benchmark.retraction import Row
from defras_bt.benchmark.row_store import RowStore
from defras_bt.cli.benchmark import app

SEED = 90_001


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return list(run_probes([("fewer", SEED)], "model", jobs=1))


def test_a_real_case_is_measured_before_after_a_tug_and_after_going_on(rows: list[Row]) -> None:
    assert [row.run for row in rows] == [GOES_ON, TUG, BEFORE]
    values = {row.run: row.values for row in rows}
    before = values[BEFORE]
    assert before["found"] == TUG
    assert before["parts_mm"] >= before["now_mm"] + 0.5
    assert before["expected_force_n"] < 0.8 * 0.6
    assert 0 < before["doubtful"] < 144
    for arm in ARMS:
        said = values[arm]
        assert said["asked"]
        assert said["doubtful"] == before["doubtful"]
        assert 0 <= said["doubtful_right"] <= 1
        assert 0 < said["brier"] < 0.25
        assert said["surface_median_mm"] < 1.0
        assert said["cpu_s"] > 0
    for arm in (TUG, GOES_ON):
        assert 0 < values[arm]["force_most_n"] < 0.6
        assert not values[arm]["over"]
    assert values[TUG]["force_most_n"] != values[GOES_ON]["force_most_n"]
    assert values[TUG]["true_force_n"] != before["true_force_n"]


def test_the_end_of_the_plan_is_the_same_place_for_all(rows: list[Row]) -> None:
    """Where nothing is adopted the same is believed as before, and the same is said of it."""
    same = [row.values for row in rows if row.run == BEFORE or not row.values["adopted"]]
    (away_mm,) = {values["ahead_surface_median_mm"] for values in same}
    assert away_mm > 0


def test_cases_that_are_done_are_not_run_again() -> None:
    done = frozenset({f"more 5 more {BEFORE}"})
    assert list(run_probes([("more", 5)], "model", jobs=1, done=done)) == []


def test_a_way_is_divided_on_a_target_or_between_two() -> None:
    start = np.zeros(3)
    targets = [np.array([0.004, 0.0, 0.0]), np.array([0.004, 0.01, 0.0])]
    first, rest = divided(start, targets, 0.006)
    np.testing.assert_allclose(first, [targets[0], [0.004, 0.002, 0.0]])
    np.testing.assert_allclose(rest, [targets[1]])
    first, rest = divided(start, targets, 0.5)
    np.testing.assert_allclose(first, targets)
    assert rest == []
    assert divided(start, [], 0.006) == ([], [])


def test_an_interval_needs_pairs_that_differ() -> None:
    assert Difference.of([0.1] * LEAST_PAIRS).sign == 1
    assert Difference.of([-0.1] * LEAST_PAIRS).sign == -1
    assert Difference.of([0.1] * (LEAST_PAIRS - 1)).sign == 0
    assert Difference.of([0.1] * (LEAST_PAIRS - 1) + [0.0] * 5).sign == 0
    assert Difference.of([0.1, -0.1] * 10).sign == 0
    assert Difference.of([]).sign == 0


def row(case: str, run: str, **values: object) -> Row:
    said = {"asked": True, "adopted": True, "f1": 0.8, "brier": 0.04, **values}
    return Row(case, case.split()[0], run, said)


def with_tug(gains: Sequence[float]) -> list[Row]:
    """One case a gain: by so much F1 is higher after the tug than after going on."""
    rows = []
    for number, gain in enumerate(gains):
        case = f"fewer {number}"
        rows += [
            row(case, GOES_ON, f1=0.8, force_most_n=0.1, over=False),
            row(case, TUG, f1=0.8 + gain, brier=0.04 - gain / 10, force_most_n=0.2, over=True),
            row(case, BEFORE, f1=0.7, found=TUG),
        ]
    return rows


GAINS = np.array([0.1, 0.05, 0.08, 0.02, 0.0, 0.06, 0.1, 0.03])


def test_the_sentence_follows_the_data() -> None:
    assert verdict(with_tug(GAINS.tolist())).startswith("A tug pays: F1")
    assert "+0.055" in verdict(with_tug(GAINS.tolist()))
    assert verdict(with_tug((-GAINS).tolist())).startswith("A tug does not pay: F1")
    mixed = verdict(with_tug((GAINS - GAINS.mean()).tolist()))
    assert mixed.startswith("A tug does not pay as far as these cases tell")
    assert verdict(with_tug([0.1, 0.1])).startswith("Whether a tug pays stays open: 2 cases")
    assert verdict([]).startswith("Whether a tug pays stays open: 0 cases")


def test_each_measure_says_which_side_is_better() -> None:
    lines = {line["measure"]: line for line in compared(with_tug(GAINS.tolist()))}
    assert lines["F1"]["better"] == TUG
    assert lines["F1"]["before, mean"] == 0.7
    assert lines["Brier score"]["better"] == TUG
    assert lines["largest true force [N]"]["better"] == GOES_ON
    assert lines["largest true force [N]"]["before, median"] is None
    assert lines["over the threshold"]["tug, mean"] == 1.0
    assert lines["F1 of changes"]["cases"] == 0
    assert lines["F1 of changes"]["better"] == "-"


def test_a_case_that_lost_the_tissue_is_no_pair() -> None:
    lost = [
        row("fewer 9", GOES_ON, f1=0.1),
        Row("fewer 9", "fewer", TUG, {"asked": False, "lost": True}),
        row("fewer 9", BEFORE, found=TUG),
    ]
    assert compared([*with_tug([0.1]), *lost])[0]["cases"] == 1


def test_how_often_there_is_doubt_and_a_tug() -> None:
    rows = [
        *with_tug([0.1]),
        row("fewer 7", BEFORE, found=UNSAFE),
        row("more 1", BEFORE, found=SURE),
        Row("more 3", "more", BEFORE, {"asked": False}),
        Row("more 5", "more", BEFORE, {"asked": False, "error": "the world broke"}),
    ]
    fewer, more, both = frequencies(rows)
    assert (fewer["seeds"], fewer["updates"]) == (2, 2)
    assert (more["seeds"], more["updates"], more["errors"]) == (3, 1, 1)
    assert fewer["left in doubt"].startswith("100 ")
    assert both["left in doubt"].startswith("67 ")
    assert both["safe tug"].startswith("33 ")
    assert both["safe tug where in doubt"].startswith("50 ")
    assert more["safe tug where in doubt"] == "-"
    assert {line["arm"] for line in run_rows(rows)} == set(ARMS)


def test_the_command_goes_on_from_its_rows_and_leaves_the_tables(tmp_path: Path) -> None:
    question = f"probe, model, seed {FIRST_SEED}"
    store = RowStore(tmp_path / "probe_model.rows.jsonl", question, resume=False)
    for hidden, seed in wrongly_believed(FIRST_SEED, 8):
        store.add(row(f"{hidden} {seed}", GOES_ON, f1=0.8))
        store.add(row(f"{hidden} {seed}", TUG, f1=0.9))
        store.add(row(f"{hidden} {seed}", BEFORE, found=TUG))
    arguments = ["probe", "--out", str(tmp_path), "--updates", "8", "--resume"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "A tug pays" in result.output
    written = json.loads((tmp_path / "probe_model.json").read_text(encoding="utf-8"))
    assert written["notes"][0].startswith("A tug pays")
    assert list(written["tables"]) == ["How often", "Cases with a tug", "Updates"]
    assert (tmp_path / "probe_model.csv").exists()
    assert (tmp_path / "probe_model.html").exists()


def test_an_unknown_world_is_refused(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["probe", "--world", "moon", "--out", str(tmp_path)])
    assert result.exit_code != 0
    assert "moon" in str(result.exception)
