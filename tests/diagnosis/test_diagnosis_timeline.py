"""``diagnosis.rrd`` holds what was seen beside both models, reproducibly."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from defras_bt.diagnosis.exhibits import Exhibits
from defras_bt.diagnosis.timeline import write_timeline
from tests.diagnosis.synthetic_diagnosis import (
    ORIGIN,
    named_verdict,
    synthetic_diagnosis,
    synthetic_replay,
    synthetic_scene,
)


def write(path: Path, seed: int = 3, exhibits: Exhibits | None = None) -> Path:
    write_timeline(
        synthetic_diagnosis(seed=seed),
        ORIGIN,
        "It relaxes.",
        path,
        scene=synthetic_scene(),
        exhibits=exhibits,
    )
    return path


def rrd(*arguments: object) -> int:
    command = [sys.executable, "-m", "rerun", "rrd", *map(str, arguments)]
    quiet = {**os.environ, "CI": "1"}
    return subprocess.run(command, env=quiet, capture_output=True, check=False).returncode


@pytest.fixture(scope="module")
def timeline(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("diagnosis") / "diagnosis.rrd"
    return write(path, exhibits=synthetic_replay())


def columns(path: Path, entity: str) -> list[dict[str, list[object]]]:
    chunks = RrdReader(path).stream().filter(content=entity, is_static=False).to_chunks()
    return [chunk.to_record_batch().to_pydict() for chunk in chunks]


def test_it_is_sound_and_reproducible(timeline: Path, tmp_path: Path) -> None:
    again = write(tmp_path / "again.rrd", exhibits=synthetic_replay())
    assert rrd("verify", timeline) == 0
    assert rrd("compare", "--unordered", timeline, again) == 0
    other = write(tmp_path / "other.rrd", seed=4, exhibits=synthetic_replay())
    assert rrd("compare", "--unordered", timeline, other) != 0


def test_both_models_and_what_was_seen_are_there(timeline: Path) -> None:
    for entity in ("plain", "extended", "observed_plain", "observed_extended"):
        rows = columns(timeline, f"/world/tissue/{entity}")
        assert sum(len(next(iter(row.values()))) for row in rows) == 6


def test_recordings_lie_one_after_another(timeline: Path) -> None:
    diagnosis = synthetic_diagnosis()
    (first, second) = columns(timeline, "/residual/force_x/extended")
    times = [np.array([t.total_seconds() for t in part["time"]]) for part in (first, second)]
    assert times[0].max() < times[1].min()
    values = np.array([row[0] for row in first["Scalars:scalars"]])
    labels = diagnosis.samples
    channel = next(i for i, c in enumerate(labels.channels) if c.name == "force x")
    chosen = (labels.channel == channel) & (labels.trajectory == 0)
    np.testing.assert_allclose(values, diagnosis.held_out_after[chosen])


def test_without_tissue_or_cause_there_are_residuals_only(tmp_path: Path) -> None:
    nothing = replace(named_verdict(), verdict="nothing", causes=())
    path = tmp_path / "arm.rrd"
    write_timeline(synthetic_diagnosis(nothing), ORIGIN, "Nothing.", path)
    entities = {chunk.entity_path for chunk in RrdReader(path).stream().to_chunks()}
    assert "/residual/force_x/as_it_was" in entities
    assert "/residual/force_x/extended" not in entities
    assert not any(entity.startswith("/world") for entity in entities)
