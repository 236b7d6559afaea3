"""Linear tissue on an elastic foundation: how far a disc gives way under a force."""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.rest_shape import Face
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.discs import ROWS, disc_rows
from defras_sim.tissue.elements import gauss_hexahedron
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.factorisation import SparseCholesky
from defras_sim.tissue.material_points import MaterialPoints
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Mesh
from defras_sim.tissue.terms import BoundaryTerm

UNIT_PA = 1.0


class FoundedTissue:
    """Tissue with a Young's modulus of 1 Pa, on a foundation that makes bending die out within
    ``depth_m``."""

    def __init__(self, mesh: Mesh, depth_m: float, poisson_ratio: float) -> None:
        self._mesh = mesh
        # All materials are the same to first order.
        body = ElasticBody(mesh, "neo_hookean", *lame_parameters("neo_hookean", 1.0, poisson_ratio))
        foundation = _Foundation(mesh, UNIT_PA / (10 * depth_m**2))
        energy = PotentialEnergy(len(mesh.nodes_m), [body, foundation])
        self._cholesky = SparseCholesky(mesh.nodes_m)
        self._cholesky.factorise(energy.tangent(mesh.nodes_m))

    def give(self, center_xy_m: Floats, radius_m: float, face: Face) -> Floats:
        """Motion per force (3,) of a disc's mean and first moments, averaged over x, y and z."""
        rows = disc_rows(self._mesh, center_xy_m[None], radius_m, face).toarray()
        forces = np.kron(rows, np.eye(3)).T
        return np.einsum("ik,ik->k", forces, self._cholesky.solve(forces)).reshape(ROWS, 3).mean(1)


class _Foundation(BoundaryTerm):
    """Holds every bit of tissue where it rests, with ``stiffness`` [N/m per m^3]."""

    name = "foundation"

    def __init__(self, mesh: Mesh, stiffness: float) -> None:
        # On tetrahedra the model's own rule is too coarse for a mass matrix by itself; with the
        # tissue's stiffness added it does.
        rule = gauss_hexahedron(3) if mesh.element == "hexahedron20" else mesh.quadrature
        points = MaterialPoints.of(mesh, rule)
        self._rest_m = mesh.nodes_m
        self.pairs = points.pairs
        mass = np.einsum("eq,qa,qb->eab", points.volumes_m3, points.values, points.values)
        self._each = stiffness * mass.ravel()

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        moved = positions_m - self._rest_m
        gradient = np.zeros_like(moved)
        np.add.at(gradient, self.pairs[:, 0], self._each[:, None] * moved[self.pairs[:, 1]])
        return 0.5 * float(np.sum(gradient * moved)), gradient

    def blocks(self, positions_m: Floats) -> Floats:
        return self._each[:, None, None] * np.eye(3)
