"""How good an estimate of attachments is, and how well the twin follows with it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from defras_bt.benchmark.attachment_cases import UpdateCase
from defras_bt.benchmark.attachment_driver import Asked
from defras_bt.learning.estimate import AttachmentEstimate
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.training.metrics import overlap
from defras_bt.monitoring.closest import closest_on_triangles
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.seen import seen_surface

NEAR_M = (0.0, 0.03, 0.06, 0.3)
"""Limits of the distances from the grasp by which precision and recall are told."""

BINS = 10
_LEAST_FORCE_N = 0.005
"""Below this a force is nothing; its relative error says nothing."""


def scored(case: UpdateCase, asked: Asked, estimate: AttachmentEstimate) -> dict[str, Any]:
    """What ``estimate``, made of ``asked``, is worth; changes are those to the case's belief."""
    belief, truth = case.believed, case.actual.attached
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
        **followed(asked, found),
    }
    return {key: None if _is_nan(value) else value for key, value in said.items()}


def followed(asked: Asked, found: Any) -> dict[str, Any]:
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


def brier(estimate: AttachmentEstimate, truth: Any, is_hole: Any) -> float:
    """Mean square of how far probabilities are from what is so, over all holes."""
    return float(np.mean((estimate.probability[is_hole] - truth[is_hole]) ** 2))


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and bool(np.isnan(value))
