"""Whether a tug at held tissue tells more about its attachments than going on as planned."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from defras_bt.benchmark.attachment_cases import Hidden, UpdateCase, draw_update
from defras_bt.benchmark.attachment_driver import Asked
from defras_bt.benchmark.attachment_runs import driven
from defras_bt.benchmark.attachment_scores import brier, followed, scored
from defras_bt.benchmark.preparations import FORCE_THRESHOLD_N
from defras_bt.benchmark.probe_motion import Moved, gone_on, tugged
from defras_bt.benchmark.retraction import Row
from defras_bt.learning.chain.estimators import estimator
from defras_bt.learning.estimate import AttachmentEstimate
from defras_bt.learning.probe.choice import ProbeChooser, Tug, doubtful_holes, explanations_of
from defras_bt.learning.search import Mask
from defras_sim.scene import Scene
from defras_sim.worlds.error import WorldError

BEFORE, TUG, GOES_ON = "before", "tug", "goes on"
ARMS = (BEFORE, TUG, GOES_ON)
"""What is known at the warning, after a tug, and after as much of the planned motion instead."""

SURE, UNSAFE = "nothing in doubt", "no safe tug"
"""What is found where there is no tug."""


@dataclass(frozen=True)
class _Learned:
    """An ``estimate`` made of ``asked``, and the seconds of computing that it took."""

    asked: Asked
    estimate: AttachmentEstimate
    cpu_s: float


@dataclass(frozen=True)
class _Doubt:
    """What is believed after the first estimate, ``holes`` (holes,) in doubt, and the tug if there
    is one."""

    believed: Scene
    holes: Mask
    tug: Tug | None
    cpu_s: float


def run_probes(
    cases: Sequence[tuple[Hidden, int]],
    world: str,
    *,
    jobs: int,
    done: frozenset[str] = frozenset(),
) -> Iterator[Row]:
    """Every case once, except those in ``done``; the row of :data:`BEFORE` is a case's last."""
    work = [
        delayed(_rows)(hidden, seed, world)
        for hidden, seed in cases
        if f"{hidden} {seed} {hidden} {BEFORE}" not in done
    ]
    for rows in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        yield from rows


def _rows(hidden: Hidden, seed: int, world: str) -> list[Row]:
    case = draw_update(hidden, seed)
    try:
        values = _measured(case, world)
    except WorldError as error:
        values = {BEFORE: {"asked": False, "error": str(error)}}
    return [Row(case.name, hidden, run, values[run]) for run in reversed(ARMS) if run in values]


def _measured(case: UpdateCase, world: str) -> dict[str, dict[str, Any]]:
    """Values by arm."""
    threshold_n = case.believed.thresholds.force_n or FORCE_THRESHOLD_N
    with driven(case, world) as driver:
        asked = driver.run()
        if asked is None:
            return {BEFORE: {"asked": False}}
        first = _learned(asked, [case.seed])
        if first.estimate.adopted:
            driver.believe(first.estimate.attached)
        doubt = _doubt(driver.scene, first, threshold_n)
        tug = doubt.tug
        if tug is None:
            found = UNSAFE if doubt.holes.any() else SURE
            return {BEFORE: {**_values(case, first, doubt), "found": found}}
        pulled = tugged(driver, tug)
    with driven(case, world) as driver:
        again = driver.run()
        if again is None or not np.array_equal(
            again.keyframes[-1].cloud_m, asked.keyframes[-1].cloud_m
        ):
            raise WorldError(f"the {world} world does not repeat {case.name}")
        if first.estimate.adopted:
            driver.believe(first.estimate.attached)
        moved, end = gone_on(driver, tug)
    expected = {
        "found": TUG,
        "parts_mm": 1e3 * tug.parts_m,
        "now_mm": 1e3 * tug.now_m,
        "expected_force_n": tug.force_n,
        "choosing_s": doubt.cpu_s,
    }
    return {
        BEFORE: {**_values(case, first, doubt), **_ahead(end, first.estimate), **expected},
        TUG: _after(case, pulled, doubt, end, threshold_n),
        GOES_ON: _after(case, moved, doubt, end, threshold_n),
    }


def _learned(asked: Asked, seed: Sequence[int]) -> _Learned:
    started = process_time()
    rng = np.random.default_rng(seed)
    estimate = estimator("chain").estimate(asked.belief, asked.keyframes, rng)
    return _Learned(asked, estimate, process_time() - started)


def _doubt(believed: Scene, first: _Learned, threshold_n: float) -> _Doubt:
    """As the tree's node chooses."""
    started = process_time()
    explanations = explanations_of(believed, first.estimate)
    tug = None
    if len(explanations) > 1:
        frames = first.asked.keyframes
        tug = ProbeChooser().choose(believed, frames, explanations, threshold_n)
    spent_s = process_time() - started
    return _Doubt(believed, doubtful_holes(believed, first.estimate), tug, spent_s)


def _after(
    case: UpdateCase, moved: Moved | None, doubt: _Doubt, end: Moved | None, threshold_n: float
) -> dict[str, Any]:
    """Learned again; the draws of chance are the same for every motion."""
    if moved is None:
        return {"asked": False, "lost": True}
    learned = _learned(moved.asked, [case.seed, 1])
    return {
        **_values(case, learned, doubt),
        **_ahead(end, learned.estimate),
        "force_most_n": moved.force_most_n,
        "force_share": moved.force_most_n / threshold_n,
        "over": moved.force_most_n > threshold_n,
    }


def _values(case: UpdateCase, learned: _Learned, doubt: _Doubt) -> dict[str, Any]:
    estimate, truth = learned.estimate, case.actual.attached
    right = (estimate.attached == truth)[doubt.holes]
    return {
        **scored(case, learned.asked, estimate),
        "brier": brier(estimate, truth, case.believed.is_hole),
        "doubtful": len(right),
        "doubtful_right": float(right.mean()) if len(right) else None,
        "cpu_s": learned.cpu_s,
        "reason": estimate.reason,
    }


def _ahead(end: Moved | None, estimate: AttachmentEstimate) -> dict[str, Any]:
    """What the twin would say of the end of the plan: the same place, whatever was done before."""
    if end is None:
        return {}
    values = followed(end.asked, estimate.attached)
    return {
        f"ahead_{key}": values.get(key)
        for key in ("surface_median_mm", "surface_95_mm", "mu_local_mm")
    }
