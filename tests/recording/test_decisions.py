"""What every node said is read back as it was written, also from a record that was cut off."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from defras_bt.executive.reasons import Code
from defras_bt.executive.testing import EPSILON_N
from defras_bt.recording.decision_reader import InvalidDecisions, read_decisions
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.moment import moment_of
from tests.executive.stage import Notes, Stage
from tests.recording.synthetic_run import SyntheticRun


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, short_run: SyntheticRun) -> tuple[Path, Notes]:
    """A run of the shipped tree that is stopped by force, lets go, plans anew, and is ended."""
    folder = tmp_path_factory.mktemp("run")
    recorder = DecisionRecorder(folder / DECISIONS_FILE)
    stage = Stage("fras", beside=[recorder])
    stage.recorder.start(short_run.info)
    stage.until_doing("pull")
    stage.bench.twin.feels_n = 2 * EPSILON_N
    stage.until("let go", lambda r: not stage.board.grips)
    stage.bench.twin.feels_n = 0.0
    stage.until_doing("reach")
    stage.bench.world.visibility = 1.0
    assert stage.until_over() == "goal"
    return folder, stage.notes


def test_every_tick_is_read_back_as_it_was(run: tuple[Path, Notes]) -> None:
    folder, notes = run
    decisions = read_decisions(folder)
    moments = list(decisions.moments())
    assert len(moments) == len(notes.records)
    for moment, record in zip(moments, notes.records, strict=True):
        told = moment_of(record, decisions.kinds)
        assert dict(moment.nodes) == dict(told.nodes)
        assert (moment.cause, moment.stopped_by, moment.ended) == (
            told.cause,
            told.stopped_by,
            told.ended,
        )
        assert [e.sentence for e in moment.events] == [e.sentence for e in record.events]


def test_a_preempted_action_is_known_with_its_last_status(run: tuple[Path, Notes]) -> None:
    decisions = read_decisions(run[0])
    stopped = next(
        m
        for m in decisions.moments()
        if m.cause and m.cause.code == Code.OPENING and m.stopped_by is not None
    )
    pull = stopped.nodes["fras/operate/act/4_pull_psm1"]
    assert (pull.ticked, pull.status, pull.code) == (False, "RUNNING", Code.MOVING)


def test_turning_points_are_where_the_decision_changes(run: tuple[Path, Notes]) -> None:
    decisions = read_decisions(run[0])
    turns = decisions.turning_points()
    said = [moment.cause.path.rpartition("/")[2] for moment in turns if moment.cause]
    assert said[:4] == ["replan", "1_reach_psm1", "2_open_psm1", "3_grasp_psm1"]
    assert said[-1] == "finish"
    assert len(turns) < len(decisions.lines) / 4
    assert turns[-1].ended is not None


@pytest.mark.parametrize("cut", [1, 30, 200])
def test_a_record_that_was_cut_off_is_read_up_to_there(
    run: tuple[Path, Notes], tmp_path: Path, cut: int
) -> None:
    whole = (run[0] / DECISIONS_FILE).read_bytes()
    cut_off = tmp_path / DECISIONS_FILE
    cut_off.write_bytes(whole[:-cut])
    kept, full = read_decisions(tmp_path), read_decisions(run[0])
    assert len(kept.lines) == len(full.lines) - 1
    assert list(kept.moments()) == list(full.moments())[:-1]


def test_every_line_is_on_disk_as_soon_as_its_tick_is_over(
    tmp_path: Path, short_run: SyntheticRun
) -> None:
    recorder = DecisionRecorder(tmp_path / DECISIONS_FILE)
    recorder.start(short_run.info)
    for count, record in enumerate(short_run.ticks()[:5], 1):
        recorder.tick(record)
        assert len(read_decisions(tmp_path).lines) == count


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ":1: schema is 'nothing'"),
        ("{}\n", ":1: schema is None"),
        ("[]\n", ":1: a line should be a JSON object"),
        ("{\n", ":1: not JSON"),
        (json.dumps({"schema": "defras/decisions/1"}) + "\n", ":1: should name tree and nodes"),
        (
            json.dumps({"schema": "defras/decisions/1", "tree": "t", "nodes": []})
            + '\n{"tick": 1}\n',
            ":2: no tick of a run",
        ),
    ],
)
def test_faults_are_told_with_their_place(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / DECISIONS_FILE).write_text(text)
    with pytest.raises(InvalidDecisions, match=says):
        list(read_decisions(tmp_path).moments())


def test_a_tick_that_does_not_exist(run: tuple[Path, Notes]) -> None:
    with pytest.raises(InvalidDecisions, match="there is no tick 99999; valid: 0 to "):
        read_decisions(run[0]).at(99999)


def test_no_record_at_all(tmp_path: Path) -> None:
    with pytest.raises(InvalidDecisions, match="defras run --out"):
        read_decisions(tmp_path)
