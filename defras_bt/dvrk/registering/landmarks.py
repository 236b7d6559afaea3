"""Landmarks: where they are on the tissue, and where an arm touched or a camera saw them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.yaml_source import Fault, InvalidFile

TISSUE = ("tissue_x_m", "tissue_y_m", "tissue_z_m")
FOUND = ("x_m", "y_m", "z_m")
COLUMNS = ("name", *TISSUE, *FOUND)
"""Of a file of landmarks; FOUND is in the frame of the arm or camera."""


@dataclass(frozen=True)
class Landmark:
    """``tissue_m`` (3,) in the tissue frame; ``found_m`` (3,) in the frame to be registered."""

    name: str
    tissue_m: Floats
    found_m: Floats


def usual_landmarks(scene: Scene) -> dict[str, Floats]:
    """Grasp points that are easy to find, on the upper face at rest: the corners of the grid and
    its middle, by name."""
    points = scene.grasp_points
    xy_m = np.array([scene.grasp_xy_m(*point) for point in points])
    middle_m = xy_m.mean(axis=0)
    towards = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    chosen = [points[int(np.argmax((xy_m - middle_m) @ way))] for way in towards]
    chosen.append(points[int(np.argmin(np.linalg.norm(xy_m - middle_m, axis=1)))])
    return {f"grasp point {point}": scene.grasp_point_m(*point) for point in dict.fromkeys(chosen)}


def read_landmarks(file: Path) -> list[Landmark]:
    """Read a CSV file with the columns :data:`COLUMNS`.

    Raises:
        InvalidFile: with every fault as file:line:column.
    """
    try:
        with file.open(newline="", encoding="utf-8") as stream:
            reader = csv.DictReader(stream)
            missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                message = f"no column {', '.join(missing)}; needed are {', '.join(COLUMNS)}"
                raise InvalidFile([Fault(file, 1, 1, message)])
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InvalidFile([Fault(file, 1, 1, f"cannot be read: {error}")]) from error
    faults, landmarks = [], []
    for line, row in rows:
        try:
            landmarks.append(
                Landmark(
                    row["name"],
                    np.array([float(row[name]) for name in TISSUE]),
                    np.array([float(row[name]) for name in FOUND]),
                )
            )
        except (TypeError, ValueError) as error:
            faults.append(Fault(file, line, 1, f"{row['name'] or 'landmark'}: {error}"))
    if faults:
        raise InvalidFile(faults)
    return landmarks


def write_landmarks(landmarks: Sequence[Landmark], file: Path) -> None:
    """Write what :func:`read_landmarks` reads.

    Raises:
        OSError: it cannot be written.
    """
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        for one in landmarks:
            numbers = [*one.tissue_m.tolist(), *one.found_m.tolist()]
            writer.writerow([one.name, *(f"{number:.6f}" for number in numbers)])
