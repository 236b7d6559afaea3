"""Sparse Cholesky factorisation of a tissue's tangent: multifrontal, on two cores.

Measured in one run for slabs of 8x8x1 and of 12x12x1 elements (1,593 and 3,393 unknowns), one
thread of an AMD EPYC, the analysis reused where the library can:

=====================================  =========  =====  =========  =====
milliseconds of the processor          factorise  solve  factorise  solve
=====================================  =========  =====  =========  =====
this module                                  1.6   0.11        6.7   0.31
MKL Pardiso, positive definite               2.6   0.60        7.4   1.39
SuperLU, minimum degree, symmetric          11.7   0.18       31.6   0.45
=====================================  =========  =====  =========  =====

QDLDL took as long as SuperLU. So no library is needed that exists for some processors only, and a
matrix that is not positive definite is told at the first pivot that is not.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import config
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue import fronts
from defras_sim.tissue.elimination import Plan, plan


class NotPositiveDefinite(ArithmeticError):
    """The matrix bends down in some direction: there is no Cholesky factor."""


class SparseCholesky:
    """Factors of symmetric positive definite matrices made of 3 x 3 blocks, one a pair of nodes.

    ``places_m`` (nodes, 3) guides the order of elimination, which is found once for matrices of one
    sparsity. Compiled code releases the interpreter while it works. One object serves one thread
    at a time.
    """

    def __init__(self, places_m: Floats, cores: int = config.NUMBA_NUM_THREADS) -> None:
        self._places_m = places_m
        self._pattern: sparse.csc_array | None = None
        self._plan: Plan
        self._panels: Floats
        self._updates: Floats
        self._helper = ThreadPoolExecutor(1) if cores > 1 else None

    @property
    def graph(self) -> sparse.csc_array:
        """Which nodes interact (nodes, nodes), in the matrices factorised."""
        return self._plan.graph

    def factorise(self, matrix: sparse.csc_array, shift: float = 0.0) -> None:
        """Factorise ``matrix`` (sorted indices) plus ``shift`` times the unit matrix.

        Raises:
            NotPositiveDefinite: it has no factor.
        """
        self._analyse(matrix)
        entries = np.ascontiguousarray(matrix.data)
        steps, halves = self._plan, self._plan.halves
        if self._helper is None or halves is None:
            found = self._eliminate(0, len(steps.sizes), entries, shift)
        else:
            left, right = halves
            other = self._helper.submit(self._eliminate, left, right, entries, shift)
            found = self._eliminate(0, left, entries, shift)
            found = other.result() and found
            found = found and self._eliminate(right, right + 1, entries, shift)
        if not found:
            raise NotPositiveDefinite(f"no Cholesky factor with {shift:.3g} on the diagonal")

    def solve(self, right: Floats) -> Floats:
        """Solve for ``right`` (unknowns,) or (unknowns, k) with the last factor."""
        steps = self._plan
        x = right[steps.unknowns]
        kernel = fronts.solve_vector if right.ndim == 1 else fronts.solve_matrix
        kernel(
            steps.sizes,
            steps.borders,
            steps.panel_starts,
            steps.first_unknowns,
            steps.border_starts,
            steps.border_nodes,
            self._panels,
            x,
        )
        solution = np.empty_like(x)
        solution[steps.unknowns] = x
        return solution

    def _analyse(self, matrix: sparse.csc_array) -> None:
        known = self._pattern
        if known is not None and _same(known, matrix):
            return
        self._plan = plan(matrix, self._places_m)
        self._pattern = matrix
        self._panels = np.empty(self._plan.panel_starts[-1])
        self._updates = np.empty(self._plan.update_starts[-1])

    def _eliminate(self, first: int, last: int, entries: Floats, shift: float) -> bool:
        steps = self._plan
        return fronts.eliminate(
            first,
            last,
            steps.sizes,
            steps.borders,
            steps.panel_starts,
            steps.update_starts,
            steps.children,
            steps.border_starts,
            steps.local,
            steps.entry_starts,
            steps.entry_places,
            steps.entry_sources,
            entries,
            shift,
            self._panels,
            self._updates,
        )


def _same(one: sparse.csc_array, other: sparse.csc_array) -> bool:
    """Whether two matrices have one sparsity; cheap where they share it."""
    return (one.indptr is other.indptr and one.indices is other.indices) or (
        np.array_equal(one.indptr, other.indptr) and np.array_equal(one.indices, other.indices)
    )
