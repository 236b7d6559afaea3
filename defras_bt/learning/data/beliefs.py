"""Wrong beliefs about the attachments, as operations begin with them or learning leaves them."""

from __future__ import annotations

import numpy as np

from defras_bt.learning.data.patients import spread
from defras_sim.attachment_patches import LAYOUTS, Mask, draw, grow, resized, shrink
from defras_sim.scene import Scene

BELIEFS = ("fewer", "more", "patch_missing", "patch_extra", "moved", "borders", "other")
"""What is believed instead of the truth: fewer or more holes in all, one patch that is not believed
or not there, patches elsewhere by a hole or two, other borders, or an unrelated draw."""

_SHARES = (0.2, 0.2, 0.18, 0.18, 0.08, 0.08, 0.08)
_FEWEST = 3


def draw_belief(truth: Scene, rng: np.random.Generator) -> tuple[str, Mask]:
    """The kind and the mask (holes,) of a belief that differs from what ``truth`` holds."""
    while True:
        kind = str(rng.choice(BELIEFS, p=_SHARES))
        mask = _drawn(kind, truth, rng) & truth.is_hole
        if mask.sum() >= _FEWEST and (mask != truth.attached).any():
            return kind, mask


def _drawn(kind: str, truth: Scene, rng: np.random.Generator) -> Mask:
    nx, ny = truth.hole_counts
    held = truth.attached
    grid, count = held.reshape(ny, nx), int(held.sum())
    if kind == "fewer":
        return resized(grid, max(_FEWEST, round(rng.uniform(0.4, 0.75) * count)), rng).ravel()
    if kind == "more":
        return resized(grid, round(rng.uniform(1.3, 3.5) * count), rng).ravel()
    if kind == "patch_missing":
        return held & ~spread(
            truth, rng.choice(np.flatnonzero(held)), int(rng.integers(2, 10)), rng
        )
    if kind == "patch_extra":
        free = np.flatnonzero(truth.is_hole & ~held)
        return held | spread(truth, rng.choice(free), int(rng.integers(2, 12)), rng)
    if kind == "moved":
        return _moved(grid, rng).ravel()
    if kind == "borders":
        return shrink(
            grow(grid, int(rng.integers(1, 5)), rng), int(rng.integers(1, 5)), rng
        ).ravel()
    return draw(str(rng.choice(LAYOUTS)), (ny, nx), rng).ravel()


def _moved(grid: Mask, rng: np.random.Generator) -> Mask:
    """Shifted by up to two holes; what leaves the tissue is lost."""
    rows, columns = rng.integers(-2, 3, size=2)
    ny, nx = grid.shape
    padded = np.pad(grid, 2)
    return padded[2 - rows : 2 - rows + ny, 2 - columns : 2 - columns + nx]
