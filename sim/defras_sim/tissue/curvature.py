"""What is known of an energy's curvature: an old factorisation, turned, and corrected by BFGS."""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.factorisation import SparseCholesky
from defras_sim.tissue.turning import node_rotations, turned

# Steps remembered. Their cost is small beside that of a solution with the factor.
_STEPS = 12


class Curvature:
    """The inverse second derivative H of an energy, as far as it is known; all shapes (nodes, 3).

    H is that of the last :meth:`factorise`, turned to where :meth:`look_from` was told to stand
    (:mod:`defras_sim.tissue.turning`), and corrected by what gradients have shown since:
    limited-memory BFGS, Nocedal and Wright, Numerical Optimization, 2nd ed., algorithm 7.4.
    Steps are remembered as they were before the tissue turned.
    """

    def __init__(self, places_m: Floats) -> None:
        self._factor = SparseCholesky(places_m)
        self._made_at_m = places_m
        self._rotations: Floats = np.tile(np.eye(3), (len(places_m), 1, 1))
        self._steps: deque[tuple[Floats, Floats, float]] = deque(maxlen=_STEPS)

    def factorise(self, tangent: sparse.csc_array, positions_m: Floats, shift: float) -> None:
        """Start anew from the ``tangent`` at ``positions_m``, ``shift`` [N/m] on its diagonal.

        Raises:
            NotPositiveDefinite: the energy bends down in some direction.
        """
        self._factor.factorise(tangent, shift)
        self._made_at_m = positions_m
        self._rotations = np.tile(np.eye(3), (len(positions_m), 1, 1))
        self._steps.clear()

    def look_from(self, positions_m: Floats) -> None:
        """Steps are from ``positions_m`` from now on."""
        graph = self._factor.graph
        self._rotations = node_rotations(graph.indptr, graph.indices, self._made_at_m, positions_m)

    def newton_step(self, gradient_n: Floats) -> Floats:
        """-H g: where a gradient g vanishes, if the energy is as it seems."""
        q = -turned(self._rotations, gradient_n, True).ravel()
        shares = []
        for step, change, inverse in reversed(self._steps):
            share = inverse * float(step @ q)
            q -= share * change
            shares.append(share)
        r = self._factor.solve(q)
        for (step, change, inverse), share in zip(self._steps, reversed(shares), strict=True):
            r += (share - inverse * float(change @ r)) * step
        return turned(self._rotations, r.reshape(gradient_n.shape), False)

    def learn(self, step_m: Floats, change_n: Floats) -> None:
        """Remember how the gradient changed along a step, unless the energy bends down there."""
        curvature = float(np.sum(step_m * change_n))
        if curvature > 0:
            step = turned(self._rotations, step_m, True).ravel()
            change = turned(self._rotations, change_n, True).ravel()
            self._steps.append((step, change, 1.0 / curvature))
