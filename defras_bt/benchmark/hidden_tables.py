"""Tables of an arm and of a specimen with a hidden cause, and errors that remember."""

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
JOINT_NOISE = np.array([1e-3, 1e-3, 1e-4, 1e-2, 1e-2, 1e-2])
"""Standard deviations (6,) of what a joint's error is besides its causes: as on a cable-driven arm
seen by a camera."""
MEMORY = 0.9
"""Of errors from one row to the next: a measured arm's residual has 0.97."""

_MODULUS_PA = 20e3
_AREA_M2 = 2e-5
_FORCE_NOISE_N = 1e-3


def arm_table(file: Path, hidden: Extension, rng: np.random.Generator, rows: int = 800) -> None:
    """Smooth set-points with reversals of all sizes, and where the joints really went.

    How much the sensors scatter is told: errors that remember look like a cause otherwise.
    """
    time_s, setpoint = random_joints(rng, rows)
    measured = true_joints(hidden, time_s, setpoint) + JOINT_NOISE * remembering(rng, rows, 6)
    columns = joint_columns(time_s, setpoint, measured)
    for i, unit in enumerate(UNITS):
        columns[f"q{i + 1}_measured_sd_{unit}"] = np.full(rows, JOINT_NOISE[i])
    write_table(file, columns)


def coupon_table(file: Path, hidden: Extension, rng: np.random.Generator) -> None:
    """A specimen pulled twice, held in between, and let go."""
    peak = rng.uniform(1.5, 1.9)
    up, hold = np.linspace(1.0, peak, 120), np.full(100, peak)
    down, again = np.linspace(peak, 1.02, 120), np.linspace(1.02, peak + 0.1, 140)
    stretch: Floats = np.concatenate([up, hold, down, again, again[::-1]])
    write_table(file, pull_columns(hidden, rng, stretch, _FORCE_NOISE_N, MEMORY))


def random_joints(rng: np.random.Generator, rows: int) -> tuple[Floats, Floats]:
    """Times and smooth set-points (rows, 6) with reversals of all sizes."""
    time_s: Floats = 0.1 * np.arange(rows, dtype=float)
    rates, phases = rng.uniform(0.3, 2.0, (4, 6)), rng.uniform(0, 2 * np.pi, (4, 6))
    waves = np.sin(rates * time_s[:, None, None] + phases).sum(axis=1) / 2
    return time_s, waves * [0.4, 0.3, 0.03, 0.7, 0.6, 0.6] + [0, 0, 0.15, 0, 0, 0]


def joint_columns(time_s: Floats, setpoint: Floats, measured: Floats) -> dict[str, Floats]:
    """Columns of a table of joints (rows, 6)."""
    columns = {"time_s": time_s}
    for what, joints in (("setpoint", setpoint), ("measured", measured)):
        for i, unit in enumerate(UNITS):
            columns[f"q{i + 1}_{what}_{unit}"] = joints[:, i]
    return columns


def pull_columns(
    hidden: Extension, rng: np.random.Generator, stretch: Floats, noise_n: float, memory: float
) -> dict[str, Floats]:
    """Columns of a specimen of 20 kPa and 20 mm2 with stretch (rows,), a row each quarter second;
    its force is seen with noise of ``noise_n`` that remembers."""
    time_s: Floats = 0.25 * np.arange(len(stretch), dtype=float)
    force_n = _AREA_M2 * nominal_stress_pa(hidden, _MODULUS_PA, time_s, stretch)
    force_n = force_n + noise_n * remembering(rng, len(stretch), 1, memory)[:, 0]
    area_m2 = np.full(len(stretch), _AREA_M2)
    return {"time_s": time_s, "stretch": stretch, "force_N": force_n, "area_m2": area_m2}


def remembering(
    rng: np.random.Generator, rows: int, columns: int, memory: float = MEMORY
) -> Floats:
    """Autocorrelated noise (rows, columns) of standard deviation 1."""
    noise = rng.normal(size=(rows, columns))
    for row in range(1, rows):
        noise[row] = memory * noise[row - 1] + np.sqrt(1 - memory**2) * noise[row]
    return noise


def write_table(file: Path, columns: Mapping[str, Floats]) -> Path:
    """Leave ``columns`` of one length in ``file``."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return file
