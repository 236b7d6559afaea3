"""What an equilibrium can be differentiated by, and how each shows in the balance of forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.discs import ROWS
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import Grasp, term_name
from defras_sim.tissue.holes import TERM_NAME as ATTACHMENTS
from defras_sim.tissue.springs import SpringTerm


@dataclass(frozen=True)
class TermParameter:
    """A parameter of a term of the energy, both by name: see ``TissueModel.terms``."""

    term: str
    parameter: str


YOUNG_MODULUS_SCALE = TermParameter("material", "stiffness_scale")
POISSON_RATIO = TermParameter("material", "poisson_ratio")
GRAVITY_M_S2 = TermParameter("gravity", "acceleration_m_s2")


@dataclass(frozen=True)
class HoleStiffness:
    """The stiffness [N/m] of one hole, by its number in ``scene.holes_xy_m``."""

    hole: int


@dataclass(frozen=True)
class TipMotion:
    """The tip of an arm that holds: six columns, a translation [m] along x, y and z, and a rotation
    [rad] about the tip around x, y and z, all in the tissue frame."""

    arm: str


Parameter = TermParameter | HoleStiffness | TipMotion


@dataclass(frozen=True)
class Change:
    """What a parameter changes at fixed positions: the gradient (nodes, 3, columns).

    Where it does so through the springs of ``spring_term``, ``spring_forces_by`` (rows, 3, columns)
    are the changes of their forces.
    """

    gradient_by: Floats
    spring_term: str | None = None
    spring_forces_by: Floats | None = None

    @property
    def columns(self) -> int:
        return self.gradient_by.shape[2]


def change_of(
    parameter: Parameter,
    energy: PotentialEnergy,
    grasps: Mapping[str, Grasp],
    positions_m: Floats,
) -> Change:
    """What ``parameter`` changes in ``energy``, whose arms hold with ``grasps``.

    Raises:
        ValueError: there is no such term, parameter, hole or holding arm.
    """
    if isinstance(parameter, TipMotion):
        grasp = grasps.get(parameter.arm)
        if grasp is None:
            raise ValueError(
                f"{parameter.arm} holds no tissue, so its tip moves nothing; holding: "
                f"{', '.join(grasps) or 'none'}"
            )
        held_by = spring_term(energy, term_name(parameter.arm))
        return _through_springs(
            held_by, held_by.pulls(positions_m).stiffness_n_per_m @ grasp.targets_by_tip_m()
        )
    if isinstance(parameter, HoleStiffness):
        held = spring_term(energy, ATTACHMENTS)
        holes = len(held.targets_m) // ROWS
        if not 0 <= parameter.hole < holes:
            raise ValueError(f"there is no hole {parameter.hole}; holes are 0 to {holes - 1}")
        pull = np.zeros((len(held.targets_m), 3, 1))
        rows = slice(ROWS * parameter.hole, ROWS * (parameter.hole + 1))
        pull[rows, :, 0] = held.pulls(positions_m).forces_by_stiffness[rows]
        return _through_springs(held, pull)
    term = energy.terms.get(parameter.term)
    if term is None:
        raise ValueError(f"there is no term {parameter.term!r}; terms: {', '.join(energy.terms)}")
    gradient_by = term.gradient_by(parameter.parameter, positions_m)[:, :, None]
    if isinstance(term, SpringTerm):
        return Change(gradient_by, term.name, term.forces_by_scale_n(positions_m)[:, :, None])
    return Change(gradient_by)


def spring_term(energy: PotentialEnergy, name: str) -> SpringTerm:
    """The term called ``name``, which consists of springs.

    Raises:
        TypeError: it is another kind of term.
    """
    term = energy.terms[name]
    if not isinstance(term, SpringTerm):
        raise TypeError(f"term {name!r} should consist of springs, is a {type(term).__name__}")
    return term


def _through_springs(term: SpringTerm, forces_by: Floats) -> Change:
    """Springs that pull more have that much less of a gradient."""
    rows = term.springs.rows
    by_node = rows.T @ forces_by.reshape(len(forces_by), -1)
    gradient_by = -by_node.reshape(rows.shape[1], 3, forces_by.shape[2])
    return Change(gradient_by, term.name, forces_by)
