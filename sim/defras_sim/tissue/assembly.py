"""Elastic energy, its gradient and its tangent, summed over all quadrature points of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.scene import MaterialName
from defras_sim.tissue import kernels, materials
from defras_sim.tissue.elements import (
    Quadrature,
    shape_gradients,
    shape_values,
)
from defras_sim.tissue.mesh import Integers, Mesh


@dataclass(frozen=True)
class PrincipalStress:
    """Largest principal Cauchy stress over all quadrature points, and where it acts now."""

    largest_pa: float
    position_m: Floats


class ElasticBody:
    """A mesh of one hyperelastic material. Positions are (nodes, 3); nothing is kept between calls.

    ``mu_pa`` and ``lam_pa`` (elements, points) are the material's own parameters, see
    :func:`defras_sim.tissue.materials.lame_parameters`; given as one number, or one an element
    (elements, 1), they are spread over the quadrature points.
    """

    def __init__(
        self,
        mesh: Mesh,
        material: MaterialName,
        mu_pa: float | Floats,
        lam_pa: float | Floats,
        rule: Quadrature | None = None,
    ) -> None:
        self.mesh = mesh
        self._code = materials.CODES[material]
        rule = rule or mesh.quadrature
        shape = len(mesh.connectivity), len(rule.weights)
        self.mu_pa = np.broadcast_to(np.asarray(mu_pa, dtype=float), shape).copy()
        self.lam_pa = np.broadcast_to(np.asarray(lam_pa, dtype=float), shape).copy()
        self._values = shape_values(mesh.element, rule.points)
        self._gradients, self._volumes = _rest_gradients(mesh, rule)
        self.pattern, self._places = _pattern(mesh.connectivity, len(mesh.nodes_m))

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        """Elastic energy [J], infinite where the material cannot be; gradient (nodes, 3) [N]."""
        gradient = np.zeros_like(positions_m)
        energy = kernels.energy_and_gradient(
            self._code,
            positions_m,
            self.mesh.connectivity,
            self._gradients,
            self._volumes,
            self.mu_pa,
            self.lam_pa,
            gradient,
        )
        return energy, gradient

    def tangent_entries(self, positions_m: Floats) -> Floats:
        """Entries of the second derivative, in the order of :attr:`pattern` (CSC, symmetric)."""
        entries = np.zeros(self.pattern.nnz)
        kernels.tangent(
            self._code,
            positions_m,
            self.mesh.connectivity,
            self._gradients,
            self._volumes,
            self.mu_pa,
            self.lam_pa,
            self._places,
            entries,
        )
        return entries

    def largest_principal_stress(self, positions_m: Floats) -> PrincipalStress:
        largest, element, point = kernels.largest_principal_stress(
            self._code,
            positions_m,
            self.mesh.connectivity,
            self._gradients,
            self.mu_pa,
            self.lam_pa,
        )
        place = self._values[point] @ positions_m[self.mesh.connectivity[element]]
        return PrincipalStress(largest, place)


def _rest_gradients(mesh: Mesh, rule: Quadrature) -> tuple[Floats, Floats]:
    """Rest gradients (elements, points, 3, nodes) and volumes (elements, points)."""
    local = shape_gradients(mesh.element, rule.points)
    corners = mesh.nodes_m[mesh.connectivity]
    jacobian = np.einsum("eai,qaj->eqij", corners, local)
    determinant = np.linalg.det(jacobian)
    if np.any(determinant <= 0):
        bad = int(np.argmin(determinant.min(axis=1)))
        raise ValueError(f"element {bad} of the mesh is inverted; its volume must be positive")
    gradients = np.einsum("qaj,eqji->eqia", local, np.linalg.inv(jacobian))
    return np.ascontiguousarray(gradients), determinant * rule.weights


def _pattern(connectivity: Integers, nodes: int) -> tuple[sparse.csc_array, NDArray[np.int32]]:
    """Sparsity of the tangent, and where the 3x3 block of each pair of nodes starts in it.

    ``places`` (elements, a, b, 3): entry of row 3 a in column 3 b + k, before the next two rows.
    """
    count, width = connectivity.shape
    rows = np.repeat(connectivity, width, axis=1).ravel()
    columns = np.tile(connectivity, (1, width)).ravel()
    graph = sparse.csc_array((np.ones(len(rows)), (rows, columns)), shape=(nodes, nodes))
    graph.sum_duplicates()
    graph.sort_indices()
    pattern = sparse.csc_array(sparse.kron(graph, np.ones((3, 3)), format="csc"))
    pattern.sort_indices()
    pattern.data[:] = 0.0
    keys = np.repeat(np.arange(nodes), np.diff(graph.indptr)) * nodes + graph.indices
    block = np.searchsorted(keys, columns * nodes + rows)
    within = block - graph.indptr[columns]
    per_column = np.diff(graph.indptr)[columns] * 3
    start = graph.indptr[columns] * 9 + within * 3
    places = start[:, None] + per_column[:, None] * np.arange(3)
    return pattern, places.reshape(count, width, width, 3).astype(np.int32)
