"""Passes of models along the keyframes, many side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from joblib import Parallel, delayed

from defras_bt.diagnosis.twins.tissue_pass import KeyShape, PassJob, run_pass
from defras_sim.effects.effect import Effect
from defras_sim.effects.tissue_effect import NoSuchTissue
from defras_sim.tissue.model import NothingToGrasp


def run_passes(
    work: Sequence[PassJob], effects: Mapping[str, Effect], jobs: int
) -> list[Sequence[KeyShape | None]]:
    """The keyframes of each job, on ``jobs`` processes; ``effects`` are known by name.

    A keyframe that a model cannot follow is None; so are all where it cannot take the tissue.
    """
    if jobs == 1 or len(work) <= 1:
        return [led(job, effects) for job in work]
    found = Parallel(n_jobs=jobs, inner_max_num_threads=1)(delayed(led)(j, effects) for j in work)
    return list(found)


def led(job: PassJob, effects: Mapping[str, Effect]) -> Sequence[KeyShape | None]:
    try:
        return run_pass(job, effects)
    except (NothingToGrasp, NoSuchTissue):
        return [None] * len(job.chosen)
