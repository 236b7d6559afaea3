"""From the files that a diagnosis is asked about to the problems that it solves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import cpu_count
from pathlib import Path
from typing import Literal

import numpy as np

from defras_bt.cli.errors import UserError
from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.exhibits import Exhibits
from defras_bt.diagnosis.problem import Problem
from defras_bt.diagnosis.quality import DataQuality
from defras_bt.diagnosis.recording import RecordedRun
from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.diagnosis.topic_map import TopicMap
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

_SAME_GRASP_M = 0.01
"""Two grasps within this are at one point."""


@dataclass(frozen=True)
class Asked:
    """What the command line said; ``jobs`` as joblib counts."""

    data: tuple[Path, ...]
    held_out: tuple[Path, ...]
    without: tuple[str, ...]
    jobs: int


@dataclass(frozen=True)
class Material:
    """What a diagnosis works on. Held-out data go further than those fitted, or are of another
    grasp point."""

    problem: Problem
    beyond_range: Problem | None
    new_grasp: Problem | None
    quality: DataQuality
    exhibits: Callable[[Diagnosis], Exhibits]


def tissue_material(asked: Asked, scene: Scene, topics: TopicMap | None) -> Material:
    """Recordings of retractions.

    Raises:
        UnusableRecording: a recording cannot be compared.
        UserError: a file is not there, or an effect to leave out is unknown.
    """
    from defras_bt.diagnosis.twins.tissue import TissueProblem
    from defras_bt.diagnosis.twins.tissue_candidates import tissue_candidates
    from defras_bt.diagnosis.twins.tissue_exhibits import tissue_exhibits

    try:
        candidates = tissue_candidates(asked.without)
    except ValueError as error:
        raise UserError(f"--without: {error}") from error
    jobs = (cpu_count() or 1) if asked.jobs < 0 else asked.jobs

    def problem(runs: Sequence[RecordedRun], *, to_score: bool = True) -> TissueProblem:
        return TissueProblem(scene, runs, candidates, jobs=jobs, to_score=to_score)

    runs = [read_recording(_recording_in(path), scene, topics) for path in asked.data]
    others = [read_recording(_recording_in(path), scene, topics) for path in asked.held_out]
    known_m = [place for run in runs for place in _grasps_m(run)]
    elsewhere = [run for run in others if _is_elsewhere(_grasps_m(run), known_m)]
    farther = [run for run in others if not any(run is other for other in elsewhere)]
    main = problem(runs, to_score=False)
    return Material(
        main,
        problem(farther) if farther else None,
        problem(elsewhere) if elsewhere else None,
        main.quality,
        lambda diagnosis: tissue_exhibits(main, diagnosis),
    )


def table_material(asked: Asked, twin: Literal["arm", "coupon"]) -> Material:
    """Tables of an arm or of specimens.

    Raises:
        InvalidFile: a table cannot be used.
    """
    from defras_bt.diagnosis.twins.table_exhibits import table_exhibits
    from defras_bt.diagnosis.twins.tables import read_problem

    if asked.without:
        raise UserError("--without is for recordings of retractions")
    main = read_problem(asked.data, twin)
    other = read_problem(asked.held_out, twin) if asked.held_out else None
    return Material(
        main, other, None, main.quality, lambda diagnosis: table_exhibits(main, diagnosis)
    )


def _recording_in(path: Path) -> Path:
    """A file as given, or the recording in the folder of a run."""
    inside = path / "recording.mcap"
    if path.is_dir() and inside.is_file():
        return inside
    if not path.exists():
        raise UserError(
            f"there is no {path}; valid are MCAP files, bags, and folders that defras run left"
        )
    return path


def _grasps_m(run: RecordedRun) -> list[Floats]:
    """Where (3,) the tips were whenever a jaw took tissue."""
    found = []
    for arm in run.motion.arms.values():
        for row in np.flatnonzero(np.diff(arm.grasped.astype(np.int8), prepend=0) == 1):
            found.append(arm.position_m[row])
    return found


def _is_elsewhere(places_m: Sequence[Floats], known_m: Sequence[Floats]) -> bool:
    """Whether tissue was taken at a point at which it never was before."""
    return any(
        all(np.linalg.norm((place - known)[:2]) > _SAME_GRASP_M for known in known_m)
        for place in places_m
    )
