"""What a force sensor at an arm's jaw says."""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats

NO_FORCE: Floats = np.zeros(3)


def measured_force_n(
    noise_sd_n: float | None, true_n: Floats, rng: np.random.Generator
) -> Floats | None:
    """The force (3,) that a jaw exerts on the tissue, with noise; None without a sensor.

    ``true_n`` (3,) and the measured force are along the axes of the tissue frame.
    """
    if noise_sd_n is None:
        return None
    return true_n + noise_sd_n * rng.standard_normal(3)
