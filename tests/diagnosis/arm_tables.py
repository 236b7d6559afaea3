"""Tables as a laboratory would write them, made from a model that is known."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from defras_sim.arm.true_joints import true_joints
from defras_sim.coupon.specimen import nominal_stress_pa
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats

UNITS = ("rad", "rad", "m", "rad", "rad", "rad")
JOINT_NOISE = np.array([2e-4, 2e-4, 2e-5, 2e-3, 2e-3, 2e-3])


def write_table(file: Path, columns: Mapping[str, Floats]) -> Path:
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return file


def random_joints(rng: np.random.Generator, rows: int) -> tuple[Floats, Floats]:
    """Times and smooth set-points (rows, 6) with reversals of all sizes."""
    time_s = 0.1 * np.arange(rows)
    rates = rng.uniform(0.3, 2.0, (4, 6))
    phases = rng.uniform(0, 2 * np.pi, (4, 6))
    waves = np.sin(rates * time_s[:, None, None] + phases).sum(axis=1) / 2
    return time_s, waves * [0.4, 0.3, 0.03, 0.7, 0.6, 0.6] + [0, 0, 0.15, 0, 0, 0]


def coloured(rng: np.random.Generator, rows: int, columns: int, memory: float = 0.9) -> Floats:
    """Autocorrelated noise of standard deviation 1 (rows, columns)."""
    noise = rng.normal(size=(rows, columns))
    for row in range(1, rows):
        noise[row] = memory * noise[row - 1] + np.sqrt(1 - memory**2) * noise[row]
    return noise


def joint_columns(time_s: Floats, setpoint: Floats, measured: Floats) -> dict[str, Floats]:
    columns = {"time_s": time_s}
    for what, joints in (("setpoint", setpoint), ("measured", measured)):
        for i, unit in enumerate(UNITS):
            columns[f"q{i + 1}_{what}_{unit}"] = joints[:, i]
    return columns


def joint_table(
    file: Path, model: Extension, rng: np.random.Generator, rows: int = 600, noise: float = 1.0
) -> Path:
    """An arm with the effects of ``model``, seen with autocorrelated noise."""
    time_s, setpoint = random_joints(rng, rows)
    seen = true_joints(model, time_s, setpoint)
    seen = seen + noise * JOINT_NOISE * coloured(rng, rows, 6)
    return write_table(file, joint_columns(time_s, setpoint, seen))


def pull_table(
    file: Path, model: Extension, rng: np.random.Generator, stretch: Floats, noise_n: float = 2e-4
) -> Path:
    """A specimen of 20 kPa and 20 mm2, a row each quarter second."""
    time_s = 0.25 * np.arange(len(stretch))
    force_n = 2e-5 * nominal_stress_pa(model, 20e3, time_s, stretch)
    force_n = force_n + noise_n * coloured(rng, len(stretch), 1, 0.7)[:, 0]
    columns = {
        "time_s": time_s,
        "stretch": stretch,
        "force_N": force_n,
        "area_m2": np.full(len(stretch), 2e-5),
    }
    return write_table(file, columns)
