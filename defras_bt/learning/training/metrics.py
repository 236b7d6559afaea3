"""How good probabilities of attachments are: overlap, calibration, and what changes they mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Mask = NDArray[np.bool_]

BINS = 15


@dataclass(frozen=True)
class Scores:
    """Of one-dimensional arrays of holes. ``cross_entropy`` in nats a hole, ``calibration_error``
    the expected calibration error (Guo et al. 2017). ``changes_f1``: overlap of the holes that
    are changed against the belief with those that really differ; NaN where none is or does."""

    holes: int
    cross_entropy: float
    f1: float
    precision: float
    recall: float
    changes_f1: float
    calibration_error: float


def scores(probability: Floats, truth: Mask, believed: Mask) -> Scores:
    """Scores of probabilities (n,) that holes hold."""
    clipped = np.clip(probability, 1e-6, 1 - 1e-6)
    entropy = -np.where(truth, np.log(clipped), np.log1p(-clipped))
    held = probability > 0.5
    precision, recall, f1 = overlap(held, truth)
    return Scores(
        holes=len(truth),
        cross_entropy=float(entropy.mean()),
        f1=f1,
        precision=precision,
        recall=recall,
        changes_f1=overlap(held != believed, truth != believed)[2],
        calibration_error=calibration_error(probability, truth),
    )


def overlap(found: Mask, wanted: Mask) -> tuple[float, float, float]:
    """Precision, recall and F1; NaN where they are not defined."""
    both = float((found & wanted).sum())
    precision = both / found.sum() if found.any() else float("nan")
    recall = both / wanted.sum() if wanted.any() else float("nan")
    marked = float(found.sum() + wanted.sum())
    return float(precision), float(recall), 2 * both / marked if marked else float("nan")


def calibration_error(probability: Floats, truth: Mask, bins: int = BINS) -> float:
    """Mean distance between what is said and how often it is so, over bins of equal width."""
    place = np.minimum((probability * bins).astype(int), bins - 1)
    count = np.bincount(place, minlength=bins)
    said = np.bincount(place, probability, minlength=bins)
    is_so = np.bincount(place, truth.astype(float), minlength=bins)
    return float(np.abs(said - is_so).sum() / max(count.sum(), 1))


def prior(believed: Mask, truth: Mask, belief_of: Mask) -> Floats:
    """What the belief alone says of ``belief_of``: how often holes hold that are believed to, and
    that are not, in ``believed`` and ``truth``."""
    held, free = truth[believed].mean(), truth[~believed].mean()
    return np.where(belief_of, held, free).astype(float)
