"""Ways to deform a slab in which parts of it hide other parts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_sim.geometry import Floats

Deform = Callable[[Floats], Floats]


def folded(radius_m: float = 0.01) -> Deform:
    """Bend the half x < 0 up and over towards the camera, around an arc."""

    def fold(points: Floats) -> Floats:
        angle = np.clip(-points[:, 0] / radius_m, 0.0, np.pi)
        straight = np.maximum(-points[:, 0] - np.pi * radius_m, 0.0)
        inner = radius_m - points[:, 2]
        bent = np.column_stack(
            [-inner * np.sin(angle) + straight, points[:, 1], radius_m - inner * np.cos(angle)]
        )
        return np.where(points[:, :1] < 0.0, bent, points)

    return fold


def wavy(seed: int, height_m: float = 0.02) -> Deform:
    """Random waves of some centimetres, upwards and sideways, that invert no tissue."""
    rng = np.random.default_rng(seed)
    waves = rng.uniform(-120.0, 120.0, (5, 2))
    phase = rng.uniform(0.0, 2 * np.pi, 5)
    weight = rng.normal(size=(5, 3)) * [0.15, 0.15, 1.0] * height_m / np.sqrt(5)

    def wave(points: Floats) -> Floats:
        return points + np.sin(points[:, :2] @ waves.T + phase) @ weight

    return wave
