"""Files of measured data as the tables that the project documents."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from defras_bt.benchmark.hidden_tables import joint_columns, write_table

ALL = ("q1", "q2", "q3", "q4", "q5", "q6")
EVERY = slice(None)


def cable_table(
    folder: Path, data: Path, run: str, joints: Sequence[str] = ALL, rows: slice = EVERY
) -> Path:
    """``random`` or ``peg``: long trajectories; ``exp1``, ``exp2``: with camera drop-outs. Only
    ``joints`` are said to be measured."""
    isolation = run.startswith("exp")
    with np.load(
        data / "arm_cable" / f"{'isolation' if isolation else 'trajectories'}.npz"
    ) as all_:
        time_s = all_[f"{run}_t" if isolation else f"{run}_t_stamp"]
        told, seen = all_[f"{run}_q_des"], all_[f"{run}_q_act"]
    columns = joint_columns(time_s[rows], told[rows], seen[rows])
    return write_table(folder / f"{run}.csv", _only(columns, joints))


def motion_table(
    folder: Path, data: Path, joints: Sequence[str] = ALL, rows: slice = EVERY
) -> Path:
    """Set-points at the times of the measurements, linear between their own."""
    with np.load(data / "arm_motion" / "motion.npz") as arrays:
        told, seen = (arrays[name].astype(float) for name in ("setpoint_js", "measured_js"))
    time_s = seen[:, 0]
    setpoint = np.stack([np.interp(time_s, told[:, 0], told[:, 2 + i]) for i in range(6)], axis=1)
    columns = joint_columns(time_s[rows], setpoint[rows], seen[rows, 2:8])
    return write_table(folder / "motion.csv", _only(columns, joints))


def _only(columns: dict[str, np.ndarray], joints: Sequence[str]) -> dict[str, np.ndarray]:
    return {
        name: values
        for name, values in columns.items()
        if "_measured_" not in name or name.split("_")[0] in joints
    }


def load_table(folder: Path, data: Path, axis: str) -> Path:
    """Pushes along ``axis``: the sensor's z looks against the push, whatever its axis."""
    with gzip.open(data / "arm_compliance" / "steps.csv.gz", "rt", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["axis"] == axis]
    columns = {
        "trajectory": np.array([f"{row['depth_m']} {row['repeat']}" for row in rows]),
        "reach_m": -_column(rows, "depth_m"),
        f"force_{axis}_N": _column(rows, "opto_z"),
        f"tip_setpoint_{axis}_m": _column(rows, f"cp_{axis}"),
        f"tip_measured_{axis}_m": _column(rows, f"track_{axis}"),
        f"tip_measured_{axis}_sd_m": _column(rows, f"track_{axis}_sd"),
    }
    return write_table(folder / f"load_{axis}.csv", columns)


def _column(rows: Sequence[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


ELASTOMER_LENGTH_MM = 80.0
ELASTOMER_AREA_M2 = 1e-5
"""The source gives no section; another one only scales the modulus."""


def elastomer_table(folder: Path, data: Path, test: str, each: int = 1) -> Path:
    """One test, or each so many of its rows."""
    with np.load(data / "coupon_elastomer" / "vhb4910.npz") as arrays:
        time_s, displacement_mm, force_n = arrays[test][::each].astype(float).T
    columns = {
        "time_s": time_s,
        "stretch": 1 + displacement_mm / ELASTOMER_LENGTH_MM,
        "force_N": force_n,
        "area_m2": np.full(len(time_s), ELASTOMER_AREA_M2),
    }
    return write_table(folder / f"{test}.csv", columns)


SILICONE_AREA_M2 = 1.8e-5


def silicone_table(folder: Path, data: Path, material: str) -> Path:
    """Pull to failure; strain is the crosshead's."""
    file = data / "coupon_silicone" / f"{material}.csv"
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Time"))
    cells = [line.split(";")[:5] for line in lines[start + 1 :]]
    rows = np.array([[float(c) for c in row] for row in cells if all(row)])
    columns = {
        "time_s": rows[:, 0],
        "stretch": 1 + rows[:, 3],
        "force_N": rows[:, 4] * 1e6 * SILICONE_AREA_M2,
        "area_m2": np.full(len(rows), SILICONE_AREA_M2),
    }
    return write_table(folder / f"{material}.csv", columns)
