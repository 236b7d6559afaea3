"""Clouds that sort into cubes in different ways."""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats


def clouds(seed: int) -> dict[str, Floats]:
    """Points (n, 3) by shape."""
    rng = np.random.default_rng(seed)
    sheet = rng.uniform(-0.06, 0.06, (700, 3)) * [1, 1, 0]
    return {
        "sheet": sheet,
        "folded sheet": np.concatenate([sheet, sheet * [0.5, 1, 1] + [0, 0, 0.01]]),
        "ball": rng.normal(0, 0.03, (500, 3)),
        "line": rng.uniform(-0.06, 0.06, (60, 1)) * [1.0, 2.0, 0.5],
        "one point": rng.normal(size=(1, 3)),
        "the same point": np.tile(rng.normal(size=(1, 3)), (30, 1)),
        "sheet and one far away": np.concatenate([sheet, [[50.0, -3.0, 2.0]]]),
        "dense": rng.uniform(-0.02, 0.02, (900, 3)) * [1, 1, 0.1],
    }
