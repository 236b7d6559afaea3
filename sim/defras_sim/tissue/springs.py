"""Springs between held quantities and places in space: how attachments and grasps hold the tissue.

A held quantity is a weighted mean of positions: of a disc (:mod:`defras_sim.tissue.discs`) or of a
single node. Between it and its spring the tissue may give way further than the mesh shows
(:mod:`defras_sim.tissue.dent`); the spring's pull then grows less than its stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.dent import Dent
from defras_sim.tissue.layout import Places
from defras_sim.tissue.matrices import jit
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.terms import unknown_parameter


@dataclass(frozen=True)
class Pulls:
    """What r springs do at given positions.

    ``forces_n`` (r, 3) act on the tissue. ``stiffness_n_per_m`` (r, 3, 3) is how they grow with the
    stretch, ``forces_by_stiffness`` (r, 3) [m] with the stiffness of the springs themselves,
    ``forces_by_modulus`` (r, 3) [N] with the scale of the tissue's own stiffness, which makes dents
    that much shallower.
    ``held_m`` (r, 3) are the held quantities of the tissue as it really is, dents included;
    ``passed_on`` (r, 3, 3) is the share of a force on them that reaches the mesh, and
    ``held_by_force`` (r, 3, 3) [m/N] how they move under it where the mesh stays.
    """

    forces_n: Floats
    stiffness_n_per_m: Floats
    forces_by_stiffness: Floats
    forces_by_modulus: Floats
    held_m: Floats
    passed_on: Floats
    held_by_force: Floats


@dataclass(frozen=True)
class _Acting:
    """Those of some springs that pull: most holes of a scene are free."""

    which: Integers
    rows: sparse.csr_array
    columns: sparse.csr_array
    """The rows, transposed."""
    stiffness_n_per_m: Floats
    dent: Dent


@dataclass(frozen=True)
class Springs:
    """Springs on weighted means of positions.

    ``rows`` (r, nodes) gives the held quantities (r, 3) [m]; ``stiffness_n_per_m`` (r,) holds
    each of them; ``dents`` is how far the tissue in between gives way, None if it does not.
    """

    rows: sparse.csr_array
    stiffness_n_per_m: Floats
    dents: Dent | None = None

    @cached_property
    def dent(self) -> Dent:
        """The dent of every spring, of no depth where there is none."""
        return Dent.none(len(self.stiffness_n_per_m)) if self.dents is None else self.dents

    def in_stiffer_tissue(self, factor: float) -> Springs:
        """The same with dents in tissue that is ``factor`` times as stiff; of the same pairs."""
        changed = Springs(self.rows, self.stiffness_n_per_m, self.dent.scaled(factor))
        changed.__dict__["pairs"] = self.pairs
        return changed

    def forces(self, positions_m: Floats, targets_m: Floats) -> Floats:
        """Generalised force (r, 3) [N] of each spring on the tissue."""
        direction, size_m = _polar(targets_m - self.rows @ positions_m)
        return self.dent.pull_n(self.stiffness_n_per_m, size_m)[:, None] * direction

    def energy_and_gradient(self, positions_m: Floats, targets_m: Floats) -> tuple[float, Floats]:
        """Energy [J] and its gradient (nodes, 3) [N]."""
        acting = self._acting
        k, dent = acting.stiffness_n_per_m, acting.dent
        direction, size_m = _polar(targets_m[acting.which] - acting.rows @ positions_m)
        pull_n = dent.pull_n(k, size_m)
        energy_j = float(np.sum(dent.energy_j(k, size_m, pull_n)))
        return energy_j, -(acting.columns @ (pull_n[:, None] * direction))

    def pulls(self, positions_m: Floats, targets_m: Floats) -> Pulls:
        """Everything about the springs at these positions."""
        mesh_m = np.asarray(self.rows @ positions_m)
        direction, size_m = _polar(targets_m - mesh_m)
        k, dent = self.stiffness_n_per_m, self.dent
        pull_n = dent.pull_n(k, size_m)
        secant, slope = dent.secant_m_per_n(pull_n), dent.slope_m_per_n(pull_n)
        depth_m = secant * pull_n
        kept_along, kept_across = 1 / (1 + k * slope), 1 / (1 + k * secant)
        return Pulls(
            forces_n=pull_n[:, None] * direction,
            stiffness_n_per_m=_along_and_across(direction, k * kept_along, k * kept_across),
            forces_by_stiffness=((size_m - depth_m) * kept_along)[:, None] * direction,
            forces_by_modulus=(pull_n * (1 - kept_along))[:, None] * direction,
            held_m=mesh_m + depth_m[:, None] * direction,
            passed_on=_along_and_across(direction, kept_along, kept_across),
            held_by_force=_along_and_across(direction, slope * kept_along, secant * kept_across),
        )

    @cached_property
    def _acting(self) -> _Acting:
        which = np.flatnonzero(self.stiffness_n_per_m > 0)
        rows = sparse.csr_array(self.rows[which])
        dent = Dent(self.dent.give_m_per_n[which], self.dent.hardening_n[which])
        columns = sparse.csr_array(rows.T)
        return _Acting(which, rows, columns, self.stiffness_n_per_m[which], dent)

    @cached_property
    def pairs(self) -> Integers:
        """Nodes (m, 2) that the springs couple, spring by spring."""
        rows = self._acting.rows
        nodes = [rows.indices[a:b] for a, b in zip(rows.indptr, rows.indptr[1:], strict=False)]
        both = [np.stack([np.repeat(n, len(n)), np.tile(n, len(n))], axis=1) for n in nodes]
        return np.concatenate([np.zeros((0, 2)), *both]).astype(np.int64)

    def add_tangent(
        self, positions_m: Floats, targets_m: Floats, places: Places, entries: Floats
    ) -> None:
        """Add the second derivative to a matrix's ``entries`` at the ``places`` of the pairs."""
        acting = self._acting
        k, dent = acting.stiffness_n_per_m, acting.dent
        direction, size_m = _polar(targets_m[acting.which] - acting.rows @ positions_m)
        pull_n = dent.pull_n(k, size_m)
        across = k / (1 + k * dent.secant_m_per_n(pull_n))
        tangents = _along_and_across(direction, dent.slope_n_per_m(k, pull_n), across)
        _add_rows(acting.rows.indptr, acting.rows.data, tangents, places, entries)


@dataclass(frozen=True)
class SpringTerm:
    """A boundary term: ``springs`` that pull what they hold to ``targets_m`` (r, 3).

    Its parameter scales all stiffnesses alike.
    """

    name: str
    springs: Springs
    targets_m: Floats

    @property
    def parameters(self) -> tuple[str, ...]:
        return ("stiffness_scale",)

    @property
    def pairs(self) -> Integers:
        return self.springs.pairs

    def forces_n(self, positions_m: Floats) -> Floats:
        """Generalised force (r, 3) of each spring on the tissue."""
        return self.springs.forces(positions_m, self.targets_m)

    def strain_energy_j(self, positions_m: Floats) -> float:
        """Energy of the dents that the springs make in the tissue."""
        sizes = np.linalg.norm(self.forces_n(positions_m), axis=1)
        return float(np.sum(self.springs.dent.strain_energy_j(sizes)))

    def forces_by_scale_n(self, positions_m: Floats) -> Floats:
        """Derivative (r, 3) of the forces by the parameter."""
        pulls = self.springs.pulls(positions_m, self.targets_m)
        return self.springs.stiffness_n_per_m[:, None] * pulls.forces_by_stiffness

    def pulls(self, positions_m: Floats) -> Pulls:
        """Everything about the springs at these positions."""
        return self.springs.pulls(positions_m, self.targets_m)

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        return self.springs.energy_and_gradient(positions_m, self.targets_m)

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        self.springs.add_tangent(positions_m, self.targets_m, places, entries)

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter not in self.parameters:
            raise unknown_parameter(self, parameter)
        return -(self.springs.rows.T @ self.forces_by_scale_n(positions_m))


def _polar(stretch_m: Floats) -> tuple[Floats, Floats]:
    """Direction (r, 3), zero without stretch, and size (r,) of stretches (r, 3)."""
    size_m = np.linalg.norm(stretch_m, axis=1)
    return stretch_m / np.where(size_m > 0, size_m, 1.0)[:, None], size_m


def _along_and_across(direction: Floats, along: Floats, across: Floats) -> Floats:
    """Matrices (r, 3, 3) that scale by ``along`` in ``direction`` and by ``across`` besides."""
    outer = direction[:, :, None] * direction[:, None, :]
    return across[:, None, None] * np.eye(3) + (along - across)[:, None, None] * outer


@jit
def _add_rows(
    starts: Integers, weights: Floats, blocks: Floats, places: Places, entries: Floats
) -> None:
    """Add w_a w_b ``blocks[r]`` for each pair of nodes a, b of each row r of weights w."""
    pair = 0
    for r in range(len(blocks)):
        for a in range(starts[r], starts[r + 1]):
            for b in range(starts[r], starts[r + 1]):
                weight = weights[a] * weights[b]
                for k in range(3):
                    for i in range(3):
                        entries[places[pair, k] + i] += weight * blocks[r, i, k]
                pair += 1
