from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatch
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from defras_bt.recording.record import RunSummary
from defras_bt.recording.summary import SummaryRecorder
from defras_bt.recording.timeline import TimelineRecorder
from defras_bt.recording.timeline_digest import timeline_digest
from tests.recording.synthetic_run import ACTUAL_MAP, SyntheticRun, synthetic_scene

QUIET = {**os.environ, "CI": "1"}


def write(run: SyntheticRun, path: Path) -> Path:
    recorder, numbers = TimelineRecorder(path), SummaryRecorder()
    for each in (recorder, numbers):
        each.start(run.info)
    for record in run.ticks():
        recorder.tick(record)
        numbers.tick(record)
    recorder.finish(numbers.summary("goal", wall_s=float(np.random.default_rng().random())))
    return path


@pytest.fixture(scope="module")
def timeline(tmp_path_factory: pytest.TempPathFactory, rich_run: SyntheticRun) -> Path:
    return write(rich_run, tmp_path_factory.mktemp("timeline") / "run.rrd")


@lru_cache(maxsize=2)
def recorded(path: Path) -> tuple[tuple[str, Any], ...]:
    """(entity path, record batch) of all that changes in time."""
    chunks = RrdReader(path).stream().filter(is_static=False).to_chunks()
    return tuple((chunk.entity_path, chunk.to_record_batch()) for chunk in chunks)


def column(path: Path, entity: str, component: str) -> list[tuple[float, Any]]:
    """(world time in s, value) of a temporal component, in order of time."""
    rows: list[tuple[float, Any]] = []
    for place, batch in recorded(path):
        if fnmatch(place, entity) and component in batch.schema.names:
            times = batch.column("sim_time").cast("int64").to_pylist()
            values = batch.column(component).to_pylist()
            rows += zip((t / 1e9 for t in times), values, strict=True)
    return sorted(rows, key=lambda row: row[0])


def rerun_rrd(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "rerun", "rrd", *map(str, arguments)]
    return subprocess.run(command, env=QUIET, capture_output=True, text=True, check=False)


def test_two_identical_runs_compare_equal(tmp_path: Path, short_run: SyntheticRun) -> None:
    run = replace(short_run, duration_s=0.6)
    first, second = (write(run, tmp_path / name) for name in ("a.rrd", "b.rrd"))
    other = write(replace(run, seed=8), tmp_path / "c.rrd")
    compared = rerun_rrd("compare", "--unordered", first, second)
    assert compared.returncode == 0, compared.stderr
    assert timeline_digest(first) != timeline_digest(other)


def test_the_digest_is_of_the_content(tmp_path: Path, short_run: SyntheticRun) -> None:
    first, second = (write(short_run, tmp_path / name) for name in ("a.rrd", "b.rrd"))
    assert first.read_bytes() != second.read_bytes()
    assert timeline_digest(first) == timeline_digest(second)


def test_the_file_is_sound(timeline: Path) -> None:
    assert rerun_rrd("verify", timeline).returncode == 0
    assert timeline.stat().st_size < 12e6


def test_signals_are_what_the_ticks_said(timeline: Path, rich_run: SyntheticRun) -> None:
    ticks = list(rich_run.ticks())
    force = column(timeline, "/signals/force_n/estimated", "Scalars:scalars")
    known = [r for r in ticks if np.isfinite(r.force_n)]
    assert len(known) < len(ticks)
    np.testing.assert_allclose([t for t, _ in force], [r.time_s for r in known], atol=1e-9)
    np.testing.assert_allclose([v[0] for _, v in force], [r.force_n for r in known])
    mu_mm = [v[0] for _, v in column(timeline, "/signals/mu_mm/local", "Scalars:scalars")]
    np.testing.assert_allclose(mu_mm, [1000 * r.reading.mu_m["local"] for r in ticks if r.reading])
    limits = column(timeline, "/signals/mu_mm/thresholds", "Scalars:scalars")
    assert (limits[0][0], limits[-1][0]) == (0.0, 16.0)
    np.testing.assert_allclose(limits[0][1], [2, 4, 6])


def test_lanes_change_when_the_state_changes(timeline: Path, rich_run: SyntheticRun) -> None:
    told = states(column(timeline, "/monitor/warning_state", "StateChange:state"))
    lived = [str(r.reading.warning_state["local"]) for r in rich_run.ticks() if r.reading]
    assert told == distinct(lived)
    lane = states(
        column(timeline, "/executive/defras/operate/act/3_grasp_psm1", "StateChange:state")
    )
    assert lane == ["RUNNING", ""]


def states(rows: Iterable[tuple[float, Any]]) -> list[str]:
    return [value[0] for _, value in rows]


def distinct(values: list[str]) -> list[str]:
    return [v for i, v in enumerate(values) if i == 0 or v != values[i - 1]]


def test_the_learned_attachments_become_visible(timeline: Path, rich_run: SyntheticRun) -> None:
    rows = column(timeline, "/world/attachments/believed", "Points3D:positions")
    believed, actual = synthetic_scene().attached, synthetic_scene(ACTUAL_MAP).attached
    assert [len(value) for _, value in rows] == [believed.sum(), (believed | actual).sum()]
    assert rows[1][0] == pytest.approx(5.6)


def test_a_surface_at_rest_is_written_once(timeline: Path) -> None:
    rows = column(timeline, "/world/tissue/simulated", "Mesh3D:vertex_positions")
    assert len([t for t, _ in rows if t < 3.0]) == 1
    assert len(rows) > 30


def test_events_are_logged_with_their_level(timeline: Path, rich_run: SyntheticRun) -> None:
    said = [e for r in rich_run.ticks() for e in r.events]
    text = [v[0] for _, v in column(timeline, "/log/*", "TextLog:text")]
    assert {e.sentence for e in said} <= set(text)
    assert text[-1] == "Goal reached: 94 % of the region is visible after 9 actions."
    levels = {v[0] for _, v in column(timeline, "/log/warning", "TextLog:level")}
    assert levels == {"WARN"}


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_what_a_killed_process_recorded_is_readable(
    tmp_path: Path, short_run: SyntheticRun
) -> None:
    path = tmp_path / "killed.rrd"
    child = os.fork()
    if child == 0:
        recorder = TimelineRecorder(path)
        recorder.start(short_run.info)
        for record in replace(short_run, duration_s=1.5).ticks():
            recorder.tick(record)
        time.sleep(0.5)  # a loaded machine may take long over what is on its way
        os.kill(os.getpid(), 9)
    os.waitpid(child, 0)
    assert len(column(path, "/signals/rate", "Scalars:scalars")) == 21


def test_a_tick_before_the_start_says_so(tmp_path: Path, short_run: SyntheticRun) -> None:
    with pytest.raises(RuntimeError, match="call start first"):
        TimelineRecorder(tmp_path / "x.rrd").tick(short_run.ticks()[0])
    TimelineRecorder(tmp_path / "y.rrd").finish(RunSummary({}))
