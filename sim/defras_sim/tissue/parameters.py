"""What an equilibrium can be differentiated by, and how each shows in the balance of forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.discs import ROW_SHIFTS, ROWS
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import Grasp, term_name
from defras_sim.tissue.holes import TERM_NAME as ATTACHMENTS
from defras_sim.tissue.springs import Pulls, SpringTerm
from defras_sim.tissue.terms import unknown_parameter


@dataclass(frozen=True)
class TermParameter:
    """A parameter of a term of the energy, both by name: see ``TissueModel.terms``."""

    term: str
    parameter: str


YOUNG_MODULUS_SCALE = TermParameter("material", "stiffness_scale")
"""Of the whole tissue: the mesh, and the dents that holes and jaws make in it."""
POISSON_RATIO = TermParameter("material", "poisson_ratio")
GRAVITY_M_S2 = TermParameter("gravity", "acceleration_m_s2")


@dataclass(frozen=True)
class HoleStiffness:
    """The stiffness [N/m] of one hole, by its number in ``scene.holes_xy_m``."""

    hole: int


@dataclass(frozen=True)
class HoleStiffnesses:
    """The stiffness of all holes at once: each grows by its number of ``by`` (holes,) [N/m]."""

    by: tuple[float, ...]


@dataclass(frozen=True)
class AttachmentHeight:
    """The height [m] of what all holes are part of."""


@dataclass(frozen=True)
class TipMotion:
    """The tip of an arm that holds: six columns, a translation [m] along x, y and z, and a rotation
    [rad] about the tip around x, y and z, all in the tissue frame."""

    arm: str


@dataclass(frozen=True)
class GraspShift:
    """How far [m] the patch that an arm holds sits away from where it sits in the jaw, in the
    direction ``along`` (3,) as seen from the tip."""

    arm: str
    along: tuple[float, float, float]


@dataclass(frozen=True)
class DentStiffness:
    """By how many times the dents at holes and jaws are stiffer than they are."""


_Single = (
    TermParameter | HoleStiffness | HoleStiffnesses | AttachmentHeight | TipMotion | GraspShift
)
Parameter = _Single | DentStiffness


@dataclass(frozen=True)
class Balance:
    """An equilibrium to be differentiated: ``positions_m`` (nodes, 3) of ``energy``, whose arms
    hold with ``grasps``."""

    energy: PotentialEnergy
    grasps: Mapping[str, Grasp]
    positions_m: Floats
    _pulls: dict[str, Pulls] = field(default_factory=dict)

    @property
    def holes(self) -> int:
        """How many there are, whether they hold or not."""
        return len(self.springs(ATTACHMENTS).targets_m) // ROWS

    def springs(self, name: str) -> SpringTerm:
        """The term called ``name``, which consists of springs.

        Raises:
            TypeError: it is another kind of term.
        """
        term = self.energy.terms[name]
        if not isinstance(term, SpringTerm):
            raise TypeError(f"term {name!r} should consist of springs, is a {type(term).__name__}")
        return term

    def pulls(self, name: str) -> Pulls:
        """What the springs of the term called ``name`` do; found out once."""
        if name not in self._pulls:
            self._pulls[name] = self.springs(name).pulls(self.positions_m)
        return self._pulls[name]


@dataclass(frozen=True)
class GradientChange:
    """A parameter changes the gradient (nodes, 3) at fixed positions."""

    gradient_by: Floats
    term: str
    columns: int = 1


@dataclass(frozen=True)
class SpringChange:
    """A parameter changes the forces (rows, 3, columns) of a term's springs at fixed positions."""

    forces_by: Floats
    term: str

    @property
    def columns(self) -> int:
        return self.forces_by.shape[2]


Change = GradientChange | SpringChange


def changes_of(parameter: Parameter, balance: Balance) -> list[Change]:
    """Everything that ``parameter`` changes, in columns that belong together.

    Raises:
        ValueError: there is no such term, parameter, hole or holding arm.
    """
    dents: list[Change] = [
        SpringChange(balance.pulls(name).forces_by_modulus[:, :, None], name)
        for name, term in balance.energy.terms.items()
        if isinstance(term, SpringTerm)
    ]
    if isinstance(parameter, DentStiffness):
        return dents
    if parameter == YOUNG_MODULUS_SCALE:
        return [_change_of(parameter, balance), *dents]
    return [_change_of(parameter, balance)]


def _change_of(parameter: _Single, balance: Balance) -> Change:
    """What ``parameter`` changes, by itself.

    Raises:
        ValueError: there is no such term, parameter, hole or holding arm.
    """
    if isinstance(parameter, TipMotion | GraspShift):
        grasp = balance.grasps.get(parameter.arm)
        if grasp is None:
            raise ValueError(
                f"{parameter.arm} holds no tissue, so its tip moves nothing; holding: "
                f"{', '.join(balance.grasps) or 'none'}"
            )
        name = term_name(parameter.arm)
        stiffness = balance.pulls(name).stiffness_n_per_m
        by_tip = grasp.targets_by_tip_m()
        if isinstance(parameter, GraspShift):
            along = grasp.tissue_from_tip.rotation @ np.array(parameter.along)
            by_tip = by_tip[:, :, :3] @ along[:, None]
        return SpringChange(stiffness @ by_tip, name)
    if isinstance(parameter, AttachmentHeight):
        upwards = np.tile(np.outer(ROW_SHIFTS, (0.0, 0.0, 1.0)), (balance.holes, 1))
        stiffness = balance.pulls(ATTACHMENTS).stiffness_n_per_m
        return SpringChange(stiffness @ upwards[:, :, None], ATTACHMENTS)
    if isinstance(parameter, HoleStiffnesses):
        if len(parameter.by) != balance.holes:
            raise ValueError(f"{len(parameter.by)} numbers given for {balance.holes} holes")
        each = np.repeat(parameter.by, ROWS)[:, None, None]
        by_stiffness = balance.pulls(ATTACHMENTS).forces_by_stiffness
        return SpringChange(each * by_stiffness[:, :, None], ATTACHMENTS)
    if isinstance(parameter, HoleStiffness):
        by_stiffness = balance.pulls(ATTACHMENTS).forces_by_stiffness
        if not 0 <= parameter.hole < balance.holes:
            last = balance.holes - 1
            raise ValueError(f"there is no hole {parameter.hole}; holes are 0 to {last}")
        rows = slice(ROWS * parameter.hole, ROWS * (parameter.hole + 1))
        forces = np.zeros((len(by_stiffness), 3, 1))
        forces[rows, :, 0] = by_stiffness[rows]
        return SpringChange(forces, ATTACHMENTS)
    term = balance.energy.terms.get(parameter.term)
    if term is None:
        known = ", ".join(balance.energy.terms)
        raise ValueError(f"there is no term {parameter.term!r}; terms: {known}")
    if isinstance(term, SpringTerm):
        if parameter.parameter not in term.parameters:
            raise unknown_parameter(term, parameter.parameter)
        return SpringChange(term.forces_by_scale_n(balance.positions_m)[:, :, None], term.name)
    gradient_by = term.gradient_by(parameter.parameter, balance.positions_m)
    return GradientChange(gradient_by, term.name)
