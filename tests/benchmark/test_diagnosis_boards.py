"""The boards of the diagnosis: cases, what counts as right, and the command."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from defras_bt.benchmark.diagnosis_boards import boards, confusion, in_words, is_right
from defras_bt.benchmark.diagnosis_cases import CAUSES, BoardCase, board_cases
from defras_bt.benchmark.diagnosis_runs import BoardRow, board_row, board_rows, times_limit
from defras_bt.cli.benchmark_diagnosis import a_third
from defras_bt.cli.main import main
from defras_bt.diagnosis.diagnosis import Ranked
from defras_sim.effects.effect import TwinName
from defras_sim.effects.library import effect


def row(board: str, causes: list[str], verdict: str, named: list[str], *alike: str) -> BoardRow:
    return BoardRow(
        " ".join([board, *causes]), board, "coupon", causes, verdict, named, list(alike), {}, 0.9,
        None, None, 0.1, 1.0, {"F-test": [True, "softening"], "BIC": [False, None],
        "median distance": [False, None], "ridge on the residual": [False, None]},
    )  # fmt: skip


ROWS = [
    row("one", ["softening"], "named", ["softening"]),
    row("one", ["stress_relaxation"], "named", ["softening"]),
    row("one", ["strain_stiffening"], "set", [], "strain_stiffening", "softening"),
    row("nothing", [], "nothing", []),
    row("nothing", [], "outside", []),
    row("lacking", ["softening"], "outside", []),
    row("two", ["softening", "stress_relaxation"], "named", ["stress_relaxation", "softening"]),
]


def test_right_is_just_what_was_hidden() -> None:
    assert [is_right(one) for one in ROWS[:3]] == [True, False, False]
    assert is_right(ROWS[-1])


def test_scores_count_each_board_by_itself() -> None:
    (score,) = boards(ROWS)["Score"]
    assert score["named right (macro)"] == "33% of 3"
    assert score["right or in the set"].startswith("67% (")
    assert score["false alarm"].startswith("50% (")
    assert score["lacking: outside"].startswith("100% (")
    assert score["two: both named or a set"].endswith("of 1")


def test_what_can_hardly_be_told_from_chance_is_scored_apart() -> None:
    strong = [replace(ROWS[0], times_limit=2.0), replace(ROWS[1], times_limit=1.9), ROWS[2]]
    (score,) = boards(strong)["Score"]
    assert score["named right (macro)"] == "33% of 3"
    assert score["from twice the limit on (macro)"] == "100% of 1"


def test_a_cause_is_as_strong_as_the_root_of_what_it_explains_beyond_chance() -> None:
    ranking = (
        Ranked("softening", 0.5, 0.8, True, {}),
        Ranked("lag@q1", 0.1, 0.05, True, {}),
        Ranked("lag@q2", 0.1, 0.2, True, {}),
        Ranked("play", 0.0, -0.1, True, {}),
    )
    assert times_limit(ranking, 0.05, ("softening",)) == 4.0
    assert times_limit(ranking, 0.05, ("lag",)) == 2.0
    assert times_limit(ranking, 0.05, ("lag@q1",)) == 1.0
    assert times_limit(ranking, 0.05, ("softening", "lag")) == 2.0
    assert times_limit(ranking, 0.05, ("play",)) == 0.0
    assert times_limit(ranking, 0.05, ("unknown",)) == 0.0
    assert times_limit(ranking, 0.05, ()) is None


def test_confusion_is_a_row_for_each_cause() -> None:
    table = {line["hidden"]: line for line in confusion(ROWS, "coupon")}
    assert table["stress_relaxation"]["softening"] == 1
    assert table["strain_stiffening"]["(set)"] == 1
    assert table["nothing"]["(outside)"] == 1
    assert table["nothing"]["runs"] == 2


def test_in_words_it_is_what_was_said_of_each_cause() -> None:
    table = {line["hidden"]: line for line in in_words(ROWS, "coupon")}
    assert table["stress_relaxation"]["said"] == "softening 1"
    assert table["strain_stiffening"]["said"] == "set of strain_stiffening, softening 1"
    assert table["nothing"] == {"hidden": "nothing", "runs": 2, "said": "nothing 1; outside 1"}


def test_a_cause_without_a_site_is_right_wherever_it_was_named() -> None:
    assert is_right(row("one", ["joint_play"], "named", ["joint_play@q1"]))
    assert not is_right(row("one", ["joint_play@q5"], "named", ["joint_play@q6"]))
    assert not is_right(row("one", ["joint_play"], "named", ["joint_play@q1", "tool_offset"]))


def test_baselines_stand_beside_on_the_same_cases() -> None:
    beside = {line["approach"]: line for line in boards(ROWS)["Beside the baselines"]}
    assert beside["F-test"]["false alarm"].startswith("100% (")
    assert beside["BIC"]["false alarm"].startswith("0% (")
    assert beside["this engine"]["false alarm"].startswith("50% (")


@pytest.mark.parametrize("twin", ["arm", "coupon", "tissue"])
def test_cases_are_of_known_effects_and_all_different(twin: TwinName) -> None:
    cases = board_cases(twin, seeds=2, nulls=3, lacking=1, pairs=4)
    assert len({case.key for case in cases}) == len(cases)
    for cause in CAUSES[twin]:
        assert twin in effect(cause.split("@")[0]).twins
    assert all(len({c.split("@")[0] for c in case.causes}) == 2 for case in cases[-4:])


def test_a_hidden_law_of_a_specimen_is_found_and_outside_where_it_is_lacking() -> None:
    found = board_row(
        BoardCase("one", "coupon", ("stress_relaxation",), 0), further=False, baselines=False
    )
    assert found.named == ["stress_relaxation"]
    assert found.covered
    assert found.times_limit is not None
    assert found.times_limit > 2.0
    lacking = board_row(
        BoardCase("lacking", "coupon", ("stress_relaxation",), 500), further=False, baselines=False
    )
    assert lacking.verdict == "outside"
    assert lacking.named == []
    assert lacking.times_limit is None or lacking.times_limit == 0.0


def test_the_command_leaves_its_boards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = [
        "diagnosis",
        "--quick",
        "--twins",
        "coupon",
        "--seeds",
        "0",
        "--nulls",
        "2",
        "--jobs",
        "1",
        "--out",
    ]
    monkeypatch.setattr(sys, "argv", ["defras", "benchmark", *arguments, str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    written = json.loads((tmp_path / "diagnosis.json").read_text())
    assert written["tables"]["Score"][0]["false alarm"].endswith("of 2")
    assert not list(tmp_path.glob("*.jsonl"))


def _ended(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    asked = ["defras", "benchmark", "diagnosis", "--quick", "--twins", "coupon", *arguments]
    monkeypatch.setattr(sys, "argv", asked)
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code


def test_only_some_causes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    counts = ["--seeds", "1", "--nulls", "0", "--lacking", "0", "--pairs", "0", "--jobs", "1"]
    few = [*counts, "--only", "stress_relaxation", "--out", str(tmp_path)]
    assert _ended(monkeypatch, *few) == 0
    written = json.loads((tmp_path / "diagnosis.json").read_text())
    assert [row["case"] for row in written["tables"]["Every case"]] == [
        "one coupon stress_relaxation 0"
    ]
    assert _ended(monkeypatch, *counts, "--only", "gravity", "--out", str(tmp_path)) == 2
    assert "--only gravity: hidden are " in capsys.readouterr().err


def test_rows_of_another_question_are_not_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "diagnosis.rows.jsonl").write_text('{"quick": true, "grasps": 2}\n')
    assert _ended(monkeypatch, "--resume", "--out", str(tmp_path)) == 2
    assert "start without --resume" in capsys.readouterr().err


def test_more_grasps_than_there_are() -> None:
    case = BoardCase("one", "coupon", ("stress_relaxation",), 0)
    with pytest.raises(ValueError, match="valid are 1 to 2"):
        list(board_rows([case], further=False, baselines=False, jobs=1, grasps=3))


def test_quick_boards_of_three_seeds_have_every_cause_of_a_retraction() -> None:
    cases = {
        seed: board_cases("tissue", seeds=1, nulls=1, lacking=0, pairs=0) for seed in (6, 7, 8)
    }
    kept = {seed: a_third(own, seed) for seed, own in cases.items()}
    hidden = [case.causes for seed in kept for case in kept[seed] if case.board == "one"]
    assert sorted(hidden) == sorted((cause,) for cause in CAUSES["tissue"])
    assert all([case.board for case in own].count("nothing") == 1 for own in kept.values())


def test_specimens_are_not_grasped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _ended(monkeypatch, "--grasps", "2", "--out", str(tmp_path)) == 2
    assert "only tissue is grasped" in capsys.readouterr().err
