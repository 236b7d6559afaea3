"""How tissue lies when nobody holds it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.loads import DeadLoad
from defras_sim.tissue.solver import Energy, NewtonSolver, Solution
from defras_sim.tissue.springs import Springs, SpringTerm
from defras_sim.tissue.terms import Term

# A frictionless bed lets tissue slide; springs of this stiffness in all keep it in place, and carry
# a millionth of a newton while doing so.
TIE_N_PER_M = 1e-2
# Newton's method stops after so many iterations and is then asked to go on from there: tissue that
# sags under its weight goes a long way.
MOST_ATTEMPTS = 12


def settled(solver: NewtonSolver, energy: Energy, start_m: Floats) -> Solution:
    """The equilibrium that ``energy`` falls to from ``start_m`` (nodes, 3), however far it is.

    ``converged`` False where none is found; the positions are the lowest found.
    """
    if not np.any(energy.energy_and_gradient(start_m)[1]):
        return Solution(start_m, True, 0)
    solver.forget()
    solution = Solution(start_m, False, 0)
    iterations = 0
    for _ in range(MOST_ATTEMPTS):
        solution = solver.minimise(energy, solution.positions_m)
        iterations += solution.iterations
        if solution.converged or solution.iterations == 0:
            break
    solver.forget()
    return Solution(solution.positions_m, solution.converged, iterations)


def is_loaded(terms: Iterable[Term]) -> bool:
    """Whether a load acts: where none does, tissue that nobody holds goes back to rest."""
    return any(isinstance(term, DeadLoad) and term.strength != 0.0 for term in terms)


def lying_m(solver: NewtonSolver, nodes_m: Floats, terms: Iterable[Term]) -> Floats:
    """Nodes (nodes, 3) of tissue that lies free under ``terms``, near ``nodes_m``.

    Raises:
        ValueError: it finds no place to lie.
    """
    each = np.full(len(nodes_m), TIE_N_PER_M / len(nodes_m))
    tie = Springs(sparse.csr_array(sparse.eye_array(len(nodes_m), format="csr")), each)
    energy = PotentialEnergy(len(nodes_m), [*terms, SpringTerm("tie", tie, nodes_m)])
    solution = settled(solver, energy, nodes_m)
    if not solution.converged:
        raise ValueError(
            "the tissue finds no place to lie on its bed under gravity; it may be too soft for its "
            "weight (tissue.young_modulus_pa, density_kg_m3, gravity_m_s2)"
        )
    return solution.positions_m
