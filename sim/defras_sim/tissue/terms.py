"""What the potential energy of a tissue is a sum of, and where new physics plugs in.

Three kinds of terms, each with a base to derive from:

- *material*: an energy density of the deformation gradient, integrated over the tissue
  (:class:`defras_sim.tissue.material_points.MaterialTerm`);
- *boundary*: an energy of nodal positions that couples given pairs of nodes
  (:class:`BoundaryTerm`);
- *load*: forces that do not follow the tissue (:class:`defras_sim.tissue.loads.DeadLoad`).

Terms never change. What depends on time or on history (a bed that breathes, stress that relaxes)
is a new term of the same name, put in place of the old one before the next solve
(:meth:`defras_sim.tissue.model.TissueModel.set_term`); as long as it couples the same ``pairs``
object, that costs nothing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache
from typing import Protocol, runtime_checkable

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue.layout import Places, add_blocks
from defras_sim.tissue.mesh import Integers

NO_PAIRS: Integers = np.zeros((0, 2), dtype=np.int64)


class Term(Protocol):
    """One summand. Positions are (nodes, 3) [m]; energies in J, gradients (nodes, 3) in N.

    ``name`` is unique in a tissue. ``parameters`` are the names by which :meth:`gradient_by`
    differentiates. ``pairs`` (m, 2) are the nodes (row, column) that the second derivative
    couples, both ways round, with the diagonal; a pair may occur more than once.
    """

    @property
    def name(self) -> str: ...

    @property
    def parameters(self) -> tuple[str, ...]: ...

    @property
    def pairs(self) -> Integers: ...

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]: ...

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        """Add the second derivative to a matrix's ``entries``; ``places`` are those of the pairs.

        See :class:`defras_sim.tissue.layout.TangentLayout`.
        """
        ...

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        """Derivative (nodes, 3) of the gradient by a parameter, at fixed positions.

        Raises:
            ValueError: the term has no such parameter.
        """
        ...


@runtime_checkable
class OnBed(Protocol):
    """A term that moves with the bed."""

    def raised(self, height_m: float) -> Term:
        """The same on a bed that is ``height_m`` higher."""
        ...


class BoundaryTerm(ABC):
    """Base of an energy of nodal positions: say which nodes it couples, and how.

    A subclass is a frozen dataclass with ``name`` and ``pairs`` among its fields.
    """

    name: str
    pairs: Integers
    parameters: tuple[str, ...] = ()

    @abstractmethod
    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]: ...

    @abstractmethod
    def blocks(self, positions_m: Floats) -> Floats:
        """Second derivative (pairs, 3, 3) [N/m] of each pair."""

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        add_blocks(self.blocks(positions_m), places, entries)

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        """Derivative (nodes, 3) of the gradient; a term with parameters overrides this."""
        raise unknown_parameter(self, parameter)


def unknown_parameter(term: Term, parameter: str) -> ValueError:
    """The error for a parameter that ``term`` does not have."""
    known = ", ".join(term.parameters) or "none"
    return ValueError(f"term {term.name!r} has no parameter {parameter!r}; it has: {known}")


@cache
def diagonal_pairs(nodes: int) -> Integers:
    """Pairs (nodes, 2) of every node with itself: one array for all terms on as many nodes."""
    pairs = np.repeat(np.arange(nodes, dtype=np.int64)[:, None], 2, axis=1)
    pairs.flags.writeable = False
    return pairs
