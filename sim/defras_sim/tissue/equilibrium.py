"""Potential energy of a tissue held by springs; its minima are the static equilibria."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.bed import Bed
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.springs import Springs


class PotentialEnergy:
    """Elastic energy of ``body``, of ``springs`` to ``targets_m`` (rows, 3), and of ``bed``.

    Without a bed the tissue floats. Unknowns are the nodes' positions (nodes, 3) [m]; the
    gradient is in N.
    """

    def __init__(
        self, body: ElasticBody, springs: Springs, targets_m: Floats, bed: Bed | None = None
    ) -> None:
        self.body = body
        self.bed = bed
        self.springs = springs
        self.targets_m = targets_m
        held = springs.tangent()
        # Springs may couple nodes of neighbouring elements: the sum's sparsity holds both.
        self._pattern = _union(body.pattern, held)
        self._body_places = _places(body.pattern, self._pattern)
        self._spring_entries = np.zeros(self._pattern.nnz)
        self._spring_entries[_places(held, self._pattern)] = held.data
        self._diagonal_places = _diagonal(self._pattern)

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        elastic, gradient = self.body.energy_and_gradient(positions_m)
        held, pull = self.springs.energy_and_gradient(positions_m, self.targets_m)
        if self.bed is None:
            return elastic + held, gradient + pull
        pressed, push = self.bed.energy_and_gradient(positions_m)
        return elastic + held + pressed, gradient + pull + push

    def tangent(self, positions_m: Floats) -> sparse.csc_array:
        """Second derivative (3 nodes, 3 nodes) [N/m], symmetric."""
        entries = self._spring_entries.copy()
        entries[self._body_places] += self.body.tangent_entries(positions_m)
        if self.bed is not None:
            entries[self._diagonal_places] += self.bed.tangent_diagonal(positions_m)
        pattern = self._pattern
        return sparse.csc_array((entries, pattern.indices, pattern.indptr), shape=pattern.shape)

    def force_scale_n(self) -> float:
        """A force that deforms the whole body by its own size: what residuals are compared to."""
        size = np.ptp(self.body.mesh.nodes_m, axis=0)
        return float(np.mean(2 * self.body.mu_pa) * np.prod(size) / size.max())


def _union(one: sparse.csc_array, other: sparse.csc_array) -> sparse.csc_array:
    def ones(matrix: sparse.csc_array) -> sparse.csc_array:
        entries = np.ones(matrix.nnz)
        return sparse.csc_array((entries, matrix.indices, matrix.indptr), shape=matrix.shape)

    union = sparse.csc_array(ones(one) + ones(other))
    union.sort_indices()
    return union


def _places(part: sparse.csc_array, whole: sparse.csc_array) -> Integers:
    """Where the entries of ``part`` stand among those of ``whole``, which holds all of them."""
    return np.searchsorted(_keys(whole), _keys(part))


def _diagonal(matrix: sparse.csc_array) -> Integers:
    """Where the diagonal's entries stand among those of ``matrix``."""
    size = np.int64(matrix.shape[0])
    return np.searchsorted(_keys(matrix), np.arange(size) * (size + 1))


def _keys(matrix: sparse.csc_array) -> Integers:
    size = np.int64(matrix.shape[0])
    columns = np.repeat(np.arange(size), np.diff(matrix.indptr))
    return columns * size + matrix.indices
