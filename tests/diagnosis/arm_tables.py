"""Tables as a laboratory would write them, made from a model that is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from defras_bt.benchmark.hidden_tables import (
    joint_columns,
    pull_columns,
    random_joints,
    remembering,
    write_table,
)
from defras_sim.arm.true_joints import true_joints
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats

JOINT_NOISE = np.array([2e-4, 2e-4, 2e-5, 2e-3, 2e-3, 2e-3])


def joint_table(
    file: Path, model: Extension, rng: np.random.Generator, rows: int = 600, noise: float = 1.0
) -> Path:
    """An arm with the effects of ``model``, seen with autocorrelated noise."""
    time_s, setpoint = random_joints(rng, rows)
    seen = true_joints(model, time_s, setpoint)
    seen = seen + noise * JOINT_NOISE * remembering(rng, rows, 6)
    return write_table(file, joint_columns(time_s, setpoint, seen))


def pull_table(
    file: Path, model: Extension, rng: np.random.Generator, stretch: Floats, noise_n: float = 2e-4
) -> Path:
    """A specimen of 20 kPa and 20 mm2, a row each quarter second."""
    return write_table(file, pull_columns(model, rng, stretch, noise_n, 0.7))
