"""How an equilibrium answers to small changes of its parameters, without solving it again.

In equilibrium the gradient g(x, p) of the energy vanishes. Differentiated, that says how the nodes
move with a parameter: K dx/dp = -dg/dp, with the tangent K that Newton's method uses anyway
(implicit differentiation). One factorisation serves all parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.discs import ROWS
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import Grasp
from defras_sim.tissue.holes import TERM_NAME as ATTACHMENTS
from defras_sim.tissue.parameters import (
    Change,
    Parameter,
    TermParameter,
    TipMotion,
    change_of,
    spring_term,
)
from defras_sim.tissue.response import Solve
from defras_sim.tissue.springs import SpringTerm
from defras_sim.tissue.surface import SurfaceMap

BED = "bed"


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of what an equilibrium says, a column for each parameter (six for a tip).

    ``columns`` says which belong to a parameter. ``nodes_by`` (nodes, 3, columns) and
    ``surface_by`` (vertices, 3, columns) are in m per unit of the parameter; forces in N per unit:
    ``grasp_forces_by`` by arm (3, columns), ``attachment_forces_by`` (holes, 3, columns),
    ``bed_force_by`` (3, columns). ``grasp_moments_by`` (3, columns) [N m per unit] are about the
    tips, which may themselves move.
    """

    columns: Mapping[Parameter, slice]
    nodes_by: Floats
    surface_by: Floats
    grasp_forces_by: Mapping[str, Floats]
    grasp_moments_by: Mapping[str, Floats]
    attachment_forces_by: Floats
    bed_force_by: Floats


def sensitivities(
    energy: PotentialEnergy,
    grasps: Mapping[str, Grasp],
    positions_m: Floats,
    surface: SurfaceMap,
    solve: Solve,
    parameters: Sequence[Parameter],
) -> Sensitivities:
    """Derivatives at the equilibrium ``positions_m`` (nodes, 3) of ``energy``.

    Raises:
        ValueError: a parameter does not exist, or is given twice.
    """
    changes: dict[Parameter, Change] = {}
    columns: dict[Parameter, slice] = {}
    size = 0
    for parameter in parameters:
        if parameter in changes:
            raise ValueError(f"{parameter} is given twice")
        change = change_of(parameter, energy, grasps, positions_m)
        changes[parameter] = change
        columns[parameter] = slice(size, size + change.columns)
        size += change.columns
    right, bed_by = np.zeros((2, *positions_m.shape, size))
    for parameter, change in changes.items():
        right[:, :, columns[parameter]] = -change.gradient_by
        if isinstance(parameter, TermParameter) and parameter.term == BED:
            bed_by[:, :, columns[parameter]] = change.gradient_by
    nodes_by = solve(right.reshape(-1, size)).reshape(right.shape)

    def forces_by(term: SpringTerm) -> Floats:
        by = -term.pulls(positions_m).stiffness_n_per_m @ _applied(term.springs.rows, nodes_by)
        for parameter, change in changes.items():
            if change.spring_term == term.name and change.spring_forces_by is not None:
                by[:, :, columns[parameter]] += change.spring_forces_by
        return by

    grasp_forces_by, grasp_moments_by = {}, {}
    for arm, grasp in grasps.items():
        by = forces_by(grasp.term(arm))
        tip_by = np.zeros((3, size))
        if TipMotion(arm) in columns:
            first = columns[TipMotion(arm)].start
            tip_by[:, first : first + 3] = np.eye(3)
        grasp_forces_by[arm] = np.einsum("r,rik->ik", grasp.shifts, by)
        grasp_moments_by[arm] = _moment_by(arm, grasp, positions_m, nodes_by, tip_by, by)
    return Sensitivities(
        columns,
        nodes_by,
        _applied(surface.from_nodes, nodes_by),
        grasp_forces_by,
        grasp_moments_by,
        forces_by(spring_term(energy, ATTACHMENTS))[::ROWS],
        _bed_force_by(energy, positions_m, nodes_by, bed_by),
    )


def _moment_by(
    arm: str,
    grasp: Grasp,
    positions_m: Floats,
    nodes_by: Floats,
    tip_by: Floats,
    forces_by: Floats,
) -> Floats:
    """Derivative (3, columns) of a grasp's moment about its tip, which moves by ``tip_by``."""
    rows, shifts = grasp.springs.rows, grasp.shifts
    levers_m = rows @ positions_m - np.outer(shifts, grasp.tissue_from_tip.position_m)
    levers_by = _applied(rows, nodes_by) - shifts[:, None, None] * tip_by
    forces_n = grasp.term(arm).forces_n(positions_m)
    turned = np.cross(levers_by, forces_n[:, :, None], axis=1)
    pulled = np.cross(levers_m[:, :, None], forces_by, axis=1)
    return (turned + pulled).sum(axis=0)


def _bed_force_by(
    energy: PotentialEnergy, positions_m: Floats, nodes_by: Floats, gradient_by: Floats
) -> Floats:
    """Derivative (3, columns); ``gradient_by`` (nodes, 3, columns) is the bed's own, explicitly."""
    bed = energy.terms.get(BED)
    if bed is None:
        return np.zeros(nodes_by.shape[1:])
    tangent = PotentialEnergy(len(positions_m), [bed]).tangent(positions_m)
    moved = (tangent @ nodes_by.reshape(-1, nodes_by.shape[2])).reshape(nodes_by.shape)
    return -(moved + gradient_by).sum(axis=0)


def _applied(rows: sparse.csr_array, nodes_by: Floats) -> Floats:
    """Derivatives (rows, 3, columns) of weighted means of positions from those of the nodes."""
    return (rows @ nodes_by.reshape(len(nodes_by), -1)).reshape(-1, *nodes_by.shape[1:])
