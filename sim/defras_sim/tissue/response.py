"""How tissue in equilibrium gives way to small forces on its nodes."""

from __future__ import annotations

from collections.abc import Callable

from scipy import sparse
from scipy.sparse.linalg import splu

from defras_sim.geometry import Floats
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.factorisation import NotPositiveDefinite, SparseCholesky

Solve = Callable[[Floats], Floats]
"""Motion (3 nodes, columns) [m] for forces on the nodes (3 nodes, columns) [N]."""


class LinearResponse:
    """Solves the tangent at one equilibrium after the other; each is factorised once."""

    def __init__(self, places_m: Floats) -> None:
        """``places_m`` (nodes, 3), for instance at rest, guide the order of elimination."""
        self._cholesky = SparseCholesky(places_m)
        self._known: tuple[PotentialEnergy, Floats, Solve] | None = None

    def at(self, energy: PotentialEnergy, positions_m: Floats) -> Solve:
        """The response at the equilibrium ``positions_m`` (nodes, 3) of ``energy``.

        It holds until this is asked for another equilibrium. The same two objects are known again.
        """
        known = self._known
        if known is None or known[0] is not energy or known[1] is not positions_m:
            solve = self._inverted(energy.tangent(positions_m))
            self._known = known = (energy, positions_m, solve)
        return known[2]

    def _inverted(self, tangent: sparse.csc_array) -> Solve:
        try:
            self._cholesky.factorise(tangent)
        except NotPositiveDefinite:
            # Tissue about to snap: its tangent bends down somewhere, but can still be solved.
            return _without_cholesky(tangent)
        return self._cholesky.solve


def _without_cholesky(tangent: sparse.csc_array) -> Solve:
    """Factorised without pivoting off the diagonal, as suits symmetric matrices."""
    factor = splu(
        tangent,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return factor.solve
