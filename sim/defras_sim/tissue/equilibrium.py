"""Potential energy of a tissue as a sum of terms; its minima are the static equilibria."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.layout import Places, TangentLayout
from defras_sim.tissue.terms import Term


class PotentialEnergy:
    """The sum of ``terms`` over nodal positions (nodes, 3) [m]; its gradient is in N.

    All terms write into one sparse matrix, laid out when the energy is made. Energies never
    change; :meth:`with_term` gives another one that shares whatever stays the same.
    """

    def __init__(self, nodes: int, terms: Iterable[Term]) -> None:
        self.terms: Mapping[str, Term] = {}
        for term in terms:
            if term.name in self.terms:
                raise ValueError(f"two terms are called {term.name!r}; names have to differ")
            self.terms = {**self.terms, term.name: term}
        self._nodes = nodes
        self._layout = TangentLayout.of(nodes, (term.pairs for term in self.terms.values()))
        self._places: dict[str, Places] = {
            name: self._layout.places(term.pairs) for name, term in self.terms.items()
        }

    def with_term(self, term: Term) -> PotentialEnergy:
        """The energy with ``term`` added, or in the place of the one of its name.

        A term with the same ``pairs`` object as the one before takes its place in the matrix.
        """
        old = self.terms.get(term.name)
        terms = {**self.terms, term.name: term}
        if old is None or old.pairs is not term.pairs:
            return PotentialEnergy(self._nodes, terms.values())
        changed = object.__new__(PotentialEnergy)
        changed.__dict__.update(self.__dict__, terms=terms)
        return changed

    def without_term(self, name: str) -> PotentialEnergy:
        """The energy without the term called ``name``.

        Raises:
            KeyError: there is none.
        """
        rest = [term for other, term in self.terms.items() if other != name]
        if len(rest) == len(self.terms):
            raise KeyError(f"no term is called {name!r}; there are: {', '.join(self.terms)}")
        return PotentialEnergy(self._nodes, rest)

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        energy, gradient = 0.0, np.zeros_like(positions_m)
        for term in self.terms.values():
            part, slope = term.energy_and_gradient(positions_m)
            energy += part
            gradient += slope
        return energy, gradient

    def tangent_of(self, name: str, positions_m: Floats) -> sparse.csc_array:
        """The second derivative of one term alone, in the sparsity of the whole."""
        entries = np.zeros(self._layout.pattern.nnz)
        self.terms[name].add_tangent(positions_m, self._places[name], entries)
        return self._layout.matrix(entries)

    def tangent(self, positions_m: Floats) -> sparse.csc_array:
        """Second derivative (3 nodes, 3 nodes) [N/m], symmetric."""
        entries = np.zeros(self._layout.pattern.nnz)
        for name, term in self.terms.items():
            term.add_tangent(positions_m, self._places[name], entries)
        return self._layout.matrix(entries)
