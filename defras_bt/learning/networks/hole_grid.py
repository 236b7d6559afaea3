"""Averages of what happens on the resting tissue over the grid of holes, for any grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats
from defras_sim.scene import Scene


@dataclass(frozen=True)
class Spread:
    """Places (n,) shared out among the four holes around each, bilinearly.

    ``index`` (n, 4) are holes, ``weight`` (n, 4) shares that sum to 1, less where some of the four
    would lie beyond the grid. ``total`` (holes,) is how much each hole gets in all.
    """

    index: NDArray[np.int64]
    weight: Floats
    total: Floats

    def sum(self, values: Floats) -> Floats:
        """Weighted sums (holes, k) of values (n, k)."""
        count = len(self.total)
        flat = self.index.ravel()
        columns = [
            np.bincount(flat, (self.weight * column[:, None]).ravel(), minlength=count)
            for column in values.T
        ]
        return np.stack(columns, axis=1)

    def mean(self, values: Floats) -> Floats:
        """Weighted means (holes, k) of values (n, k); 0 where nothing lies near a hole."""
        return self.sum(values) / np.maximum(self.total, 1e-3)[:, None]


def spread(scene: Scene, xy_m: Floats) -> Spread:
    """Share places ``xy_m`` (n, 2) on the resting tissue out among the holes of ``scene``."""
    nx, ny = scene.hole_counts
    counts = np.array([nx, ny])
    at = xy_m / scene.attachments.hole_pitch_m + (counts - 1) / 2
    low = np.floor(at).astype(np.int64)
    share = at - low
    index, weight = np.zeros((len(at), 4), np.int64), np.zeros((len(at), 4))
    for corner, step in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
        place = low + np.array(step)
        inside = ((place >= 0) & (place < counts)).all(axis=1)
        parts = np.where(np.array(step) == 1, share, 1 - share)
        weight[:, corner] = parts.prod(axis=1) * inside
        index[:, corner] = np.where(inside, place[:, 1] * nx + place[:, 0], 0)
    total: Floats = np.bincount(index.ravel(), weight.ravel(), minlength=nx * ny).astype(float)
    return Spread(index, weight, total)
