from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from defras_bt.recording.operator_state import Mode, OperatorState
from defras_bt.recording.record import Cause, Event
from defras_bt.recording.run_file import SCHEMA_FILE, RunFile, schema_text
from defras_bt.recording.summary import SummaryRecorder, read_run_json
from defras_bt.recording.versions import versions
from tests.recording.synthetic_run import SyntheticRun

# The keys that the documentation of recordings promises, and the mean force.
PROMISED = {
    "reason",
    "operator",
    "outcome",
    "roi_visibility",
    "actions",
    "replans",
    "warnings",
    "attachment_updates",
    "force_threshold_n",
    "force_max_n",
    "force_mean_n",
    "force_max_true_n",
    "time_over_threshold_s",
    "ticks_over_threshold",
    "time_over_threshold_true_s",
    "duration_s",
    "wall_s",
    "seed",
    "scene",
    "actual",
    "world",
    "tree",
    "versions",
    "substituted",
    "stream",
}


def summed(run: SyntheticRun, path: Path | None = None) -> SummaryRecorder:
    recorder = SummaryRecorder(path)
    recorder.start(run.info)
    for record in run.ticks():
        recorder.tick(record)
    return recorder


def test_numbers_against_the_ticks(short_run: SyntheticRun) -> None:
    ticks = list(short_run.ticks())
    values = summed(short_run).summary("goal", wall_s=3.5).values
    force_n = np.array([record.force_n for record in ticks])
    assert values["force_max_n"] == np.nanmax(force_n)
    assert values["force_mean_n"] == pytest.approx(force_n[force_n > 0].mean())
    assert values["force_max_true_n"] == max(r.true_force_n for r in ticks)
    assert values["ticks_over_threshold"] == np.sum(force_n > 0.3) > 0
    assert values["time_over_threshold_s"] == pytest.approx(0.05 * np.sum(force_n > 0.3))
    over = sum(record.true_force_n > 0.3 for record in ticks)
    assert values["time_over_threshold_true_s"] == pytest.approx(0.05 * over)
    assert values["actions"] == 9
    assert values["replans"] == 1
    assert values["warnings"] == {"1": 1, "2": 1, "3": 0}
    assert values["attachment_updates"] == {"tried": 2, "adopted": 1}
    assert values["roi_visibility"] == pytest.approx(0.94)
    assert values["duration_s"] == pytest.approx(16.0)
    assert values["wall_s"] == 3.5


def test_keys_are_the_promised_ones(short_run: SyntheticRun, tmp_path: Path) -> None:
    recorder = summed(replace(short_run, duration_s=1.0), tmp_path / "run.json")
    recorder.finish(recorder.summary("not_reached", wall_s=1.0))
    assert set(json.loads((tmp_path / "run.json").read_text())) == PROMISED
    assert read_run_json(tmp_path / "run.json").outcome == "not_reached"
    assert [file.name for file in tmp_path.iterdir()] == ["run.json"]


def test_what_nobody_knows_is_null(short_run: SyntheticRun) -> None:
    run = replace(short_run, with_truth=False, duration_s=0.0)
    recorder = SummaryRecorder()
    recorder.start(run.info)
    values = recorder.summary("error", wall_s=0.0).values
    unknown = [key for key, value in values.items() if value is None]
    assert unknown == [
        "reason",
        "roi_visibility",
        "force_max_n",
        "force_mean_n",
        "force_max_true_n",
        "time_over_threshold_true_s",
        "actual",
        "stream",
    ]


def test_shipped_schema_is_the_current_one() -> None:
    assert SCHEMA_FILE.read_text() == schema_text()
    # Runs of before it was counted can still be read.
    required = PROMISED - {"time_over_threshold_true_s"}
    assert set(json.loads(SCHEMA_FILE.read_text())["required"]) == required


@pytest.mark.parametrize(
    "change", [{"outcome": "won"}, {"roi_visibility": 1.2}, {"extra": 1}, {"force_max_n": -1.0}]
)
def test_schema_refuses(short_run: SyntheticRun, change: dict[str, object]) -> None:
    recorder = SummaryRecorder()
    recorder.start(short_run.info)
    values = dict(recorder.summary("goal", wall_s=0.0).values)
    RunFile.model_validate(values)
    with pytest.raises(ValidationError):
        RunFile.model_validate(values | change)


def test_learning_without_a_verdict_is_an_error(short_run: SyntheticRun) -> None:
    record = replace(
        short_run.ticks()[0], events=(Event(0.0, "learning", "info", "Something was learned."),)
    )
    recorder = SummaryRecorder()
    recorder.start(short_run.info)
    with pytest.raises(ValueError, match=r"data\['adopted'\]"):
        recorder.tick(record)


def test_versions_name_the_interpreter_and_the_engine() -> None:
    assert {"python", "defras", "py-trees", "numpy"} <= set(versions())


def test_the_reason_and_the_operator_s_acts_are_kept(short_run: SyntheticRun) -> None:
    recorder = SummaryRecorder()
    recorder.start(short_run.info)
    first, second, third = short_run.ticks()[:3]
    pause = {"act": "pause", "source": "keyboard", "words": "swab"}
    told = Event(first.time_s, "operator", "warning", "The operator paused.", pause)
    recorder.tick(replace(first, operator=OperatorState(Mode.PAUSED, "paused"), events=(told,)))
    recorder.tick(replace(second, operator=OperatorState(Mode.TAKEN_OVER, "taken over")))
    recorder.tick(replace(third, ended=Cause("stopped", "the operator asked to stop")))
    values = recorder.summary("human", wall_s=1.0).values
    assert values["reason"] == {"code": "stopped", "sentence": "the operator asked to stop"}
    assert values["operator"]["acts"] == [{"time_s": first.time_s, **pause}]
    assert values["operator"]["held_s"] == pytest.approx(2 * short_run.info.scene.tick_s)


def test_how_setpoints_were_streamed_is_kept(short_run: SyntheticRun) -> None:
    way = {"median_s": 0.015, "p99_s": 0.03}
    period = {**way, "nominal_s": 0.01, "count": 4000, "longest_s": 0.05}
    stream = {"period": period, "latency": {"psm1": way}, "taken_up": None, "realtime": True}
    recorder = SummaryRecorder()
    recorder.start(short_run.info)
    values = recorder.summary("goal", wall_s=1.0, stream=stream).values
    assert values["stream"] == stream
