"""The converged solution that models of tissue are measured against, and how it is made.

27-node hexahedra, 24x24x2, integrated with 27 points, in felupe, at every 5 mm of each motion. Each
checkpoint starts from this project's own fine solution, which only saves felupe the way: what is
stored is in equilibrium by felupe's own elements, assembly and materials, to the residual stored
beside it. How far it has converged itself: on 32x32x2 elements forces are up to 2.3 % smaller, a
third of what errors of models are allowed, and surfaces lie 0.09 mm away in the median, 0.2 mm at
the 95th percentile, because discs of 3 mm radius dent the finer mesh a little more. (Measured on
both lifts, the corner fold and the planar move, neo-Hookean, and on the corotational off-centre
lift.) On 16x16x2 elements the off-centre lift takes up to 3 % more force.

``python -m defras_bt.benchmark.tissue_reference`` makes the file anew; that takes hours.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from defras_bt.benchmark.felupe_slab import FelupeSlab
from defras_bt.benchmark.tissue_motions import CHECKPOINT_M, MOTIONS, Motion, surface_grid_m
from defras_sim.geometry import Floats
from defras_sim.scene import MaterialName
from defras_sim.tissue.factorisation import SparseCholesky
from defras_sim.tissue.model import TissueModel

FILE = Path(__file__).with_name("tissue_reference.npz")
MATERIALS: tuple[MaterialName, ...] = ("neo_hookean", "corotational")
CELLS_XYZ = (24, 24, 2)
ARM = "psm1"
# Positions are stored as whole numbers of this, far below any difference that is looked for.
UNIT_M = 5e-6
RESIDUAL_N = 1e-6
_MOST_STEPS = 20
_START_STEP_M = 0.0025


@dataclass(frozen=True)
class Reference:
    """One motion of one material at its checkpoints.

    ``moved_m`` (n, 3) is how far the tip has gone, ``forces_n`` (n, 3) the force of the jaw on the
    tissue, ``surfaces_m`` (n, 625, 3) the upper face at the places of
    :func:`defras_bt.benchmark.tissue_motions.surface_grid_m`, ``residuals_n`` (n,) what is
    unbalanced.
    """

    moved_m: Floats
    forces_n: Floats
    surfaces_m: Floats
    residuals_n: Floats


@cache
def reference(motion: str, material: MaterialName) -> Reference:
    """The stored solution of a motion, by its name."""
    with np.load(FILE) as stored:
        key = f"{motion}/{material}"
        return Reference(
            stored[f"{key}/moved_m"],
            stored[f"{key}/forces_n"],
            stored[f"{key}/surfaces"] * UNIT_M,
            stored[f"{key}/residuals_n"],
        )


def solved(motion: Motion, material: MaterialName, starts_m: Iterator[Floats]) -> Reference:
    """The checkpoints of a motion by felupe; each starts from the next of ``starts_m``.

    Starts are positions (n, 3) of felupe's nodes.

    Raises:
        ArithmeticError: a checkpoint does not get into equilibrium.
    """
    slab = FelupeSlab(
        motion.scene(), material, "hexahedron27", CELLS_XYZ, np.array(motion.grasp_xy_m)
    )
    on_grid = slab.interpolation(surface_grid_m(motion.scene().tissue))
    moved, forces, surfaces, residuals = [], [], [], []
    for tip, start_m in zip(motion.tips(CHECKPOINT_M), starts_m, strict=True):
        moved.append(tip.position_m - motion.start.position_m)
        slab.move_tip_to(moved[-1])
        slab.place(start_m)
        residuals.append(_settle(slab))
        forces.append(slab.grasp_force_n())
        surfaces.append(on_grid @ slab.positions_m)
    return Reference(*map(np.array, (moved, forces, surfaces, residuals)))


def _settle(slab: FelupeSlab) -> float:
    """Newton's method on felupe's residual and tangent; the residual that is left."""
    cholesky = SparseCholesky(slab.nodes_m)
    for _ in range(_MOST_STEPS):
        residual = slab.residual_n()
        size = float(np.linalg.norm(residual))
        if size <= RESIDUAL_N:
            return size
        tangent = sparse.csc_array(slab.tangent())
        tangent.sort_indices()
        cholesky.factorise(tangent)
        step = cholesky.solve(-residual).reshape(-1, 3)
        slab.place(slab.positions_m + step)
    raise ArithmeticError(f"{size:.2g} N are unbalanced after {_MOST_STEPS} steps")


def own_starts(motion: Motion, material: MaterialName) -> Iterator[Floats]:
    """This project's fine solution at each checkpoint, on felupe's nodes."""
    model = TissueModel(
        motion.scene(), element="hexahedron20", elements_xyz=CELLS_XYZ, material=material
    )
    there = FelupeSlab(
        motion.scene(), material, "hexahedron27", CELLS_XYZ, np.array(motion.grasp_xy_m)
    )
    on_nodes = model.mesh.interpolation(there.nodes_m)
    model.grasp(ARM, motion.start)
    every = round(CHECKPOINT_M / _START_STEP_M)
    for number, tip in enumerate(motion.tips(_START_STEP_M), start=1):
        state = model.solve({ARM: tip})
        if number % every == 0:
            yield on_nodes @ state.nodes_m


def write(file: Path, found: dict[str, Reference]) -> None:
    """Store references by "motion/material"."""
    arrays: dict[str, Any] = {}
    for key, one in found.items():
        arrays[f"{key}/moved_m"] = one.moved_m
        arrays[f"{key}/forces_n"] = one.forces_n
        arrays[f"{key}/surfaces"] = np.round(one.surfaces_m / UNIT_M).astype(np.int16)
        arrays[f"{key}/residuals_n"] = one.residuals_n
    np.savez_compressed(file, **arrays)


def main() -> None:
    """Make the file anew."""
    found = {}
    for motion in MOTIONS:
        for material in MATERIALS:
            found[f"{motion.name}/{material}"] = solved(
                motion, material, own_starts(motion, material)
            )
            print(f"{motion.title}, {material}: done", file=sys.stderr, flush=True)
    write(FILE, found)


if __name__ == "__main__":
    main()
