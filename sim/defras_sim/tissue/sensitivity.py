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
from defras_sim.tissue.grasp import term_name
from defras_sim.tissue.holes import TERM_NAME as ATTACHMENTS
from defras_sim.tissue.parameters import (
    Balance,
    Change,
    Parameter,
    SpringChange,
    TipMotion,
    changes_of,
)
from defras_sim.tissue.response import Solve
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
    balance: Balance, surface: SurfaceMap, solve: Solve, parameters: Sequence[Parameter]
) -> Sensitivities:
    """Derivatives at an equilibrium; ``solve`` gives its linear response to nodal forces.

    Raises:
        ValueError: a parameter does not exist, or is given twice.
    """
    changes = {parameter: changes_of(parameter, balance) for parameter in parameters}
    if len(changes) < len(parameters):
        twice = next(p for i, p in enumerate(parameters) if p in parameters[:i])
        raise ValueError(f"{twice} is given twice")
    columns = _columns(changes)
    size = sum(each[0].columns for each in changes.values())
    nodes = balance.positions_m.shape
    right, bed_by = np.zeros((*nodes, size)), np.zeros((*nodes, size))
    explicit: dict[str, Floats] = {}
    for parameter, change in ((key, one) for key, each in changes.items() for one in each):
        where = columns[parameter]
        if isinstance(change, SpringChange):
            shape = (len(change.forces_by), 3, size)
            explicit.setdefault(change.term, np.zeros(shape))[:, :, where] = change.forces_by
        else:
            right[:, :, where] = -change.gradient_by[:, :, None]
            if change.term == BED:
                bed_by[:, :, where] = change.gradient_by[:, :, None]
    for name, pulled in explicit.items():
        right += _applied(sparse.csr_array(balance.springs(name).springs.rows.T), pulled)
    nodes_by = solve(right.reshape(-1, size)).reshape(right.shape)

    def forces_by(name: str) -> Floats:
        moved = _applied(balance.springs(name).springs.rows, nodes_by)
        by = -balance.pulls(name).stiffness_n_per_m @ moved
        return by + explicit[name] if name in explicit else by

    forces = {arm: forces_by(term_name(arm)) for arm in balance.grasps}
    return Sensitivities(
        columns,
        nodes_by,
        _applied(surface.from_nodes, nodes_by),
        {arm: np.einsum("r,rik->ik", balance.grasps[arm].shifts, by) for arm, by in forces.items()},
        {arm: _moment_by(arm, balance, nodes_by, columns, by) for arm, by in forces.items()},
        forces_by(ATTACHMENTS)[::ROWS],
        _bed_force_by(balance, nodes_by, bed_by),
    )


def _columns(changes: Mapping[Parameter, Sequence[Change]]) -> dict[Parameter, slice]:
    columns, first = {}, 0
    for parameter, each in changes.items():
        columns[parameter] = slice(first, first + each[0].columns)
        first += each[0].columns
    return columns


def _moment_by(
    arm: str,
    balance: Balance,
    nodes_by: Floats,
    columns: Mapping[Parameter, slice],
    forces_by: Floats,
) -> Floats:
    """Derivative (3, columns) of a grasp's moment about its tip, which may itself move."""
    grasp = balance.grasps[arm]
    rows, shifts = grasp.springs.rows, grasp.shifts
    tip_by = np.zeros(nodes_by.shape[1:])
    if TipMotion(arm) in columns:
        first = columns[TipMotion(arm)].start
        tip_by[:, first : first + 3] = np.eye(3)
    levers_m = rows @ balance.positions_m - np.outer(shifts, grasp.tissue_from_tip.position_m)
    levers_by = _applied(rows, nodes_by) - shifts[:, None, None] * tip_by
    forces_n = balance.pulls(term_name(arm)).forces_n
    turned = np.cross(levers_by, forces_n[:, :, None], axis=1)
    pulled = np.cross(levers_m[:, :, None], forces_by, axis=1)
    return (turned + pulled).sum(axis=0)


def _bed_force_by(balance: Balance, nodes_by: Floats, gradient_by: Floats) -> Floats:
    """Derivative (3, columns); ``gradient_by`` (nodes, 3, columns) is the bed's own, explicitly."""
    if BED not in balance.energy.terms:
        return np.zeros(nodes_by.shape[1:])
    tangent = balance.energy.tangent_of(BED, balance.positions_m)
    # The sum over the nodes first: three rows serve all columns.
    summed = np.tile(np.eye(3), len(nodes_by)) @ tangent
    return -(summed @ nodes_by.reshape(-1, nodes_by.shape[2]) + gradient_by.sum(axis=0))


def _applied(rows: sparse.csr_array, nodes_by: Floats) -> Floats:
    """Derivatives (rows, 3, columns) of weighted means of positions from those of the nodes."""
    means = np.asarray(rows @ nodes_by.reshape(len(nodes_by), -1), dtype=float)
    return means.reshape(-1, *nodes_by.shape[1:])
