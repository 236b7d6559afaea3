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
    time_s: Floats = 0.1 * np.arange(rows, dtype=float)
    rates, phases = rng.uniform(0.3, 2.0, (4, 6)), rng.uniform(0, 2 * np.pi, (4, 6))
    waves = np.sin(rates * time_s[:, None, None] + phases).sum(axis=1) / 2
    setpoint = waves * [0.4, 0.3, 0.03, 0.7, 0.6, 0.6] + [0, 0, 0.15, 0, 0, 0]
    measured = true_joints(hidden, time_s, setpoint) + JOINT_NOISE * _remembering(rng, rows, 6)
    columns = {"time_s": time_s}
    for what, joints in (("setpoint", setpoint), ("measured", measured)):
        for i, unit in enumerate(UNITS):
            columns[f"q{i + 1}_{what}_{unit}"] = joints[:, i]
    for i, unit in enumerate(UNITS):
        columns[f"q{i + 1}_measured_sd_{unit}"] = np.full(rows, JOINT_NOISE[i])
    _write(file, columns)


def coupon_table(file: Path, hidden: Extension, rng: np.random.Generator) -> None:
    """A specimen pulled twice, held in between, and let go."""
    peak = rng.uniform(1.5, 1.9)
    up, hold = np.linspace(1.0, peak, 120), np.full(100, peak)
    down, again = np.linspace(peak, 1.02, 120), np.linspace(1.02, peak + 0.1, 140)
    stretch: Floats = np.concatenate([up, hold, down, again, again[::-1]])
    time_s: Floats = 0.25 * np.arange(len(stretch), dtype=float)
    force_n = _AREA_M2 * nominal_stress_pa(hidden, _MODULUS_PA, time_s, stretch)
    force_n = force_n + _FORCE_NOISE_N * _remembering(rng, len(stretch), 1)[:, 0]
    area_m2 = np.full(len(stretch), _AREA_M2)
    _write(file, {"time_s": time_s, "stretch": stretch, "force_N": force_n, "area_m2": area_m2})


def _remembering(rng: np.random.Generator, rows: int, columns: int) -> Floats:
    """Autocorrelated noise (rows, columns) of standard deviation 1."""
    noise = rng.normal(size=(rows, columns))
    for row in range(1, rows):
        noise[row] = MEMORY * noise[row - 1] + np.sqrt(1 - MEMORY**2) * noise[row]
    return noise


def _write(file: Path, columns: Mapping[str, Floats]) -> None:
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
