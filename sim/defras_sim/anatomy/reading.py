"""Reading a surface from a file, in metres and the right way up."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import trimesh

from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.geometry import Floats

Unit = Literal["m", "cm", "mm"]
Axis = Literal["x", "-x", "y", "-y", "z", "-z"]

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001}
SUFFIXES = (".stl", ".obj", ".ply")
SMALLEST_M, LARGEST_M = 0.02, 0.4
MOST_TRIANGLES = 300_000

# Rows: the file's axes that become x, y and z of the tissue frame.
_UPRIGHT: dict[Axis, Floats] = {
    "z": np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    "-z": np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]]),
    "y": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]]),
    "-y": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0.0]]),
    "x": np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0.0]]),
    "-x": np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]]),
}


def read_surface(file: Path, unit: Unit, up: Axis = "z") -> trimesh.Trimesh:
    """The triangles of an STL, OBJ or PLY file, in metres, with ``up`` of the file as z.

    Raises:
        RefusedSurface: the file holds no surface of an organ's size.
    """
    if file.suffix.lower() not in SUFFIXES:
        raise RefusedSurface(f"{file}: {file.suffix or 'no suffix'}; valid are .stl, .obj and .ply")
    try:
        mesh = trimesh.load(file, force="mesh", process=False)
    except Exception as error:
        # The readers of the three formats raise whatever their parsers trip over.
        raise RefusedSurface(f"{file} cannot be read as a surface: {error}") from error
    vertices = np.asarray(getattr(mesh, "vertices", np.zeros((0, 3))), dtype=float)
    triangles = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), dtype=np.int64)
    if not len(triangles):
        raise RefusedSurface(f"{file} holds no triangles; a point cloud needs a surface first")
    if len(triangles) > MOST_TRIANGLES:
        raise RefusedSurface(
            f"{file} has {len(triangles)} triangles; at most {MOST_TRIANGLES}: decimate it first"
        )
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(bad):
        raise RefusedSurface(
            f"{file}: {len(bad)} of {len(vertices)} vertices are no numbers, the first is number "
            f"{bad[0]}; every coordinate should be finite"
        )
    upright = vertices @ _UPRIGHT[up].T * METRES[unit]
    _require_size(file, np.ptp(upright[triangles].reshape(-1, 3), axis=0), unit)
    return trimesh.Trimesh(upright, triangles, process=False)


def _require_size(file: Path, size_m: Floats, unit: Unit) -> None:
    largest_m = float(size_m.max())
    if SMALLEST_M <= largest_m <= LARGEST_M:
        return
    others = [
        name
        for name, metres in METRES.items()
        if SMALLEST_M <= largest_m * metres / METRES[unit] <= LARGEST_M
    ]
    hint = f"; is its unit {' or '.join(others)}? Then say --unit {others[0]}" if others else ""
    measures = " x ".join(f"{1e3 * side:.4g}" for side in size_m)
    raise RefusedSurface(
        f"{file} measures {measures} mm, taken in {unit}; its longest side should be "
        f"{1e3 * SMALLEST_M:g} to {1e3 * LARGEST_M:g} mm{hint}"
    )
