"""What each estimator makes of the same updates: does the twin follow again, and is it right."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from time import perf_counter, process_time
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from defras_bt.benchmark.attachment_cases import Hidden, UpdateCase, draw_update
from defras_bt.benchmark.attachment_runs import Asked, asked_update
from defras_bt.benchmark.retraction import Row
from defras_bt.learning.chain.estimators import EstimatorName, estimator
from defras_bt.learning.estimate import AttachmentEstimate
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.training.metrics import overlap
from defras_bt.monitoring.closest import closest_on_triangles
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.seen import seen_surface
from defras_sim.worlds.error import WorldError

NOBODY = "belief"
"""The row that says how things stand before any update."""

ORACLE = "actual"
"""The row of the actual attachments on the twin's mesh: what could be had at best."""

NEAR_M = (0.0, 0.03, 0.06, 0.3)
"""Limits of the distances from the grasp by which precision and recall are told."""

BINS = 10
_LEAST_FORCE_N = 0.005
"""Below this a force is nothing; its relative error says nothing."""


def run_updates(
    cases: Sequence[tuple[Hidden, int]],
    names: Sequence[EstimatorName],
    world: str,
    *,
    jobs: int,
    done: frozenset[str] = frozenset(),
) -> Iterator[Row]:
    """Every case once, with every estimator on the same keyframes, except those in ``done``."""
    work = [
        delayed(_rows)(hidden, seed, tuple(names), world)
        for hidden, seed in cases
        if f"{hidden} {seed} {hidden} {NOBODY}" not in done
    ]
    for rows in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        yield from rows


def _rows(hidden: Hidden, seed: int, names: tuple[EstimatorName, ...], world: str) -> list[Row]:
    """Rows of the estimators, and at last that of the belief, which says that all are there."""
    case = draw_update(hidden, seed)
    nothing = {"asked": False}
    try:
        asked = asked_update(case, world)
    except WorldError as error:
        return [Row(case.name, hidden, NOBODY, {**nothing, "error": str(error)})]
    if asked is None:
        return [Row(case.name, hidden, NOBODY, nothing)]
    rows = []
    for name in names:
        made = estimator(name)
        before, cpu = perf_counter(), process_time()
        estimate = made.estimate(asked.belief, asked.keyframes, np.random.default_rng(seed))
        spent = {"wall_s": perf_counter() - before, "cpu_s": process_time() - cpu}
        values = {**_scored(case, asked, estimate), **spent, "reason": estimate.reason}
        rows.append(Row(case.name, hidden, name, values))
    for run, attached in ((ORACLE, case.actual.attached), (NOBODY, asked.belief.attached)):
        known = AttachmentEstimate(attached, attached.astype(float), np.nan, np.nan, False, "")
        rows.append(Row(case.name, hidden, run, _scored(case, asked, known)))
    return rows


def _scored(case: UpdateCase, asked: Asked, estimate: AttachmentEstimate) -> dict[str, Any]:
    belief, truth = asked.belief, case.actual.attached
    found = estimate.attached
    precision, recall, f1 = overlap(found, truth)
    said: dict[str, Any] = {
        "asked": True,
        "adopted": estimate.adopted,
        "changed": int((found != belief.attached).sum()),
        "f1": f1,
        "precision": precision,
        "recall": recall,
        "changes_f1": overlap(found != belief.attached, truth != belief.attached)[2],
        **_by_distance(case, found),
        **_calibration(estimate, truth, belief.is_hole),
        **_followed(asked, found),
    }
    return {key: None if _is_nan(value) else value for key, value in said.items()}


def _followed(asked: Asked, found: Any) -> dict[str, Any]:
    """How far the twin with ``found`` (holes,) is from what is seen, and from what is."""
    belief, camera = asked.belief, asked.belief.depth_camera
    try:
        state = Replay(belief, asked.keyframes).repeat(belief.hole_stiffness_n_per_m(found))[-1]
    except NotRepeatable:
        return {"follows": False}
    seen = seen_surface(state.surface, camera)
    mu_mm = {
        metric.name: 1e3
        * asked.calibration[metric.name].mu_m(
            metric.measure(asked.keyframes[-1].cloud_m, seen).value_m
        )
        for metric in (LocalMetric(), MedianMetric())
    }
    surface = state.surface
    true = asked.true_surface
    away = closest_on_triangles(
        np.ascontiguousarray(true.vertices_m[true.upper]),
        surface.vertices_m[surface.triangles],
    ).distance_m
    force_n = max(float(np.linalg.norm(f)) for f in state.grasp_forces_n.values())
    error = abs(force_n - asked.true_force_n) / max(asked.true_force_n, _LEAST_FORCE_N)
    delta_mm = {name: 1e3 * asked.calibration[name].delta_m[0] for name in mu_mm}
    return {
        "follows": True,
        **{f"mu_{name}_mm": value for name, value in mu_mm.items()},
        **{f"under_{name}": bool(mu_mm[name] <= delta_mm[name]) for name in mu_mm},
        "surface_median_mm": float(1e3 * np.median(away)),
        "surface_95_mm": float(1e3 * np.percentile(away, 95)),
        "force_n": force_n,
        "true_force_n": asked.true_force_n,
        "force_error": error,
    }


def _by_distance(case: UpdateCase, found: Any) -> dict[str, Any]:
    """Holes found, wanted, and both, by distance from the grasp."""
    scene, truth = case.believed, case.actual.attached
    away_m = np.linalg.norm(scene.holes_xy_m - scene.grasp_xy_m(*case.point), axis=1)
    counts = {}
    for number, (low_m, high_m) in enumerate(pairwise(NEAR_M)):
        near = (away_m >= low_m) & (away_m < high_m)
        counts[f"near{number}"] = [
            int((found & near).sum()),
            int((truth & near).sum()),
            int((found & truth & near).sum()),
        ]
    return counts


def _calibration(estimate: AttachmentEstimate, truth: Any, is_hole: Any) -> dict[str, Any]:
    """Per bin of probability: holes, the sum of what is said, and how many hold."""
    said, holds = estimate.probability[is_hole], truth[is_hole]
    place = np.minimum((said * BINS).astype(int), BINS - 1)
    return {
        "bins": [
            np.bincount(place, minlength=BINS).tolist(),
            np.round(np.bincount(place, said, minlength=BINS), 3).tolist(),
            np.bincount(place, holds.astype(float), minlength=BINS).tolist(),
        ]
    }


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and bool(np.isnan(value))
