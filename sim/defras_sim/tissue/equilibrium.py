"""Potential energy of a tissue held by springs; its minima are the static equilibria."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.springs import Springs


class PotentialEnergy:
    """Elastic energy of ``body`` plus the energy of ``springs`` to ``targets_m`` (p, 3).

    Unknowns are the nodes' positions (nodes, 3) [m]; the gradient is in N.
    """

    def __init__(self, body: ElasticBody, springs: Springs, targets_m: Floats) -> None:
        self.body = body
        self.springs = springs
        self.targets_m = targets_m
        self._spring_entries = body.entries_of(springs.tangent())

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        elastic, gradient = self.body.energy_and_gradient(positions_m)
        held, pull = self.springs.energy_and_gradient(positions_m, self.targets_m)
        return elastic + held, gradient + pull

    def tangent(self, positions_m: Floats) -> sparse.csc_array:
        """Second derivative (3 nodes, 3 nodes) [N/m], symmetric."""
        pattern = self.body.pattern
        entries = self.body.tangent_entries(positions_m)
        entries += self._spring_entries
        return sparse.csc_array((entries, pattern.indices, pattern.indptr), shape=pattern.shape)

    def force_scale_n(self) -> float:
        """A force that deforms the whole body by its own size: what residuals are compared to."""
        volume = float(np.prod(np.ptp(self.body.mesh.nodes_m, axis=0)))
        stiffness = float(np.mean(2 * self.body.mu_pa))
        return stiffness * volume / float(np.ptp(self.body.mesh.nodes_m, axis=0).max())
