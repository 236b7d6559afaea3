"""The benchmark of whole retractions: its cases, its rows on disk, its numbers."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from defras_bt.benchmark.cases import (
    configurations,
    generated_cases,
    shipped,
    table1_cases,
    table2_cases,
)
from defras_bt.benchmark.force_error import ForceError
from defras_bt.benchmark.retraction import Row
from defras_bt.benchmark.retraction_summary import by_case, spread, success
from defras_bt.benchmark.row_store import OtherBenchmark, RowStore
from defras_bt.recording.record import Event


def test_sixteen_cases_nine_setups_and_seventeen_configurations():
    assert len(table1_cases()) == 16
    assert len(table2_cases()) == 9
    assert len(set(configurations())) == 17


def test_table_1_varies_reality_and_table_2_the_belief():
    for case in table1_cases():
        believed, actual = case.scenes()
        ratio = actual.attached.sum() / believed.attached.sum()
        assert (ratio < 1) == (case.relation == "fewer")
    for case in table2_cases():
        believed, actual = case.scenes()
        assert actual == shipped(case.name)
        ratio = believed.attached.sum() / actual.attached.sum()
        assert {"fewer": ratio < 1, "more": ratio > 1, "equal": ratio == 1}[case.relation]


def test_every_seed_gives_one_case_with_fewer_and_one_with_more():
    cases = generated_cases(7, 2)
    assert [(c.seed, c.relation) for c in cases] == [
        (7, "fewer"),
        (7, "more"),
        (8, "fewer"),
        (8, "more"),
    ]


def tick(estimated_n, true_n, *, adopted=None):
    events = () if adopted is None else (Event(0.0, "learning", "info", "", {"adopted": adopted}),)
    return SimpleNamespace(force_n=estimated_n, true_force_n=true_n, events=events)


def test_force_errors_before_the_first_and_after_the_last_update():
    error = ForceError()
    ticks = [
        tick(0.0, 0.0),  # nothing held
        tick(0.1, 0.3),
        tick(0.2, 0.3, adopted=False),
        tick(0.5, 0.4, adopted=True),
        tick(0.4, 0.45, adopted=True),
        tick(float("nan"), 0.4),
        tick(0.4, None),
    ]
    for record in ticks:
        error.tick(record)
    assert error.values()["force_error_before_n"] == pytest.approx(0.15)
    assert error.values()["force_error_after_n"] == pytest.approx(0.05)


def test_without_an_update_there_is_no_after():
    error = ForceError()
    error.tick(tick(0.1, 0.2))
    assert error.values() == {
        "force_error_before_n": pytest.approx(0.1),
        "force_error_after_n": None,
    }


def row(case, outcome, force_n=0.1, run="defras"):
    return Row(case, "more", run, {"outcome": outcome, "force_max_true_n": force_n})


ROWS = [row("a", "goal", 0.1), row("b", "goal", 0.3), row("c", "human", 0.8), row("d", "no scene")]


def test_success_has_wilsons_interval_and_leaves_out_what_is_no_scene():
    line = success(ROWS)[-1]
    assert line["goal reached"] == "2 of 3"
    # Wilson's score interval for 2 of 3, from its formula
    assert line["95 % interval"] == "0.21 to 0.94"
    assert line["human asked"] == 1


def test_the_worst_stands_beside_the_median():
    line = next(line for line in spread(ROWS[:3]) if line["measure"] == "F max true N")
    assert (line["median"], line["mean"], line["worst"]) == (0.3, 0.4, 0.8)
    assert [line["case"] for line in by_case(ROWS[:3])] == ["a more", "b more", "c more"]


def test_rows_survive_a_kill_and_are_not_mixed_with_others(tmp_path):
    file = tmp_path / "rows"
    store = RowStore(file, "table1, seed 0", resume=False)
    for one in ROWS[:2]:
        store.add(one)
    file.write_text(file.read_text() + '{"case": "cut sho')
    again = RowStore(file, "table1, seed 0", resume=True)
    assert again.rows == ROWS[:2]
    assert again.done == {"a more defras", "b more defras"}
    again.add(ROWS[2])
    assert RowStore(file, "table1, seed 0", resume=True).rows == ROWS[:3]
    with pytest.raises(OtherBenchmark, match="start without --resume"):
        RowStore(file, "table1, seed 1", resume=True)
    assert RowStore(file, "table1, seed 1", resume=False).rows == []


def test_a_case_says_why_its_goal_was_not_reached():
    reason = {"code": "blamed", "sentence": "the tip is not where it is told to be"}
    told = {"outcome": "human", "reason": reason}
    broke = {"outcome": "error", "error": "the world went away"}
    reached = {"outcome": "goal", "reason": {"code": "goal", "sentence": "the goal is reached"}}
    lines = by_case(
        [Row("a", "more", run, v) for run, v in zip("xyz", (told, broke, reached), strict=True)]
    )
    assert [line["why not"] for line in lines] == [reason["sentence"], broke["error"], None]
