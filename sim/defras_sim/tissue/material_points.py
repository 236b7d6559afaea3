"""The quadrature points of a mesh, and material terms: energies of the deformation there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.tissue import integration
from defras_sim.tissue.elements import Quadrature, shape_gradients, shape_values
from defras_sim.tissue.layout import Places
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import unknown_parameter


@dataclass(frozen=True)
class MaterialPoints:
    """What integrating over a mesh needs, laid out once and shared by all material terms.

    ``values`` (points, nodes of an element) are shape functions, ``gradients`` (elements, points,
    3, nodes of an element) their rest gradients [1/m], ``volumes_m3`` (elements, points).
    ``pairs`` (elements x width x width, 2) are all pairs of nodes of each element.
    """

    mesh: Mesh
    values: Floats
    gradients: Floats
    volumes_m3: Floats
    pairs: Integers

    @staticmethod
    def of(mesh: Mesh, rule: Quadrature) -> MaterialPoints:
        """The points of ``rule`` in every element of ``mesh``.

        Raises:
            ValueError: an element is inverted.
        """
        local = shape_gradients(mesh.element, rule.points)
        corners = mesh.nodes_m[mesh.connectivity]
        jacobian = np.einsum("eai,qaj->eqij", corners, local)
        determinant = np.linalg.det(jacobian)
        if np.any(determinant <= 0):
            bad = int(np.argmin(determinant.min(axis=1)))
            raise ValueError(f"element {bad} of the mesh is inverted; its volume must be positive")
        gradients = np.einsum("qaj,eqji->eqia", local, np.linalg.inv(jacobian))
        return MaterialPoints(
            mesh,
            shape_values(mesh.element, rule.points),
            np.ascontiguousarray(gradients),
            determinant * rule.weights,
            _element_pairs(mesh.connectivity),
        )

    def thickened(self, scale: float | Floats) -> MaterialPoints:
        """The points of a rest shape ``scale`` times as thick along z, everywhere or at each point.

        Where the rest shape lies does not matter to any material, only how it is shaped.
        """
        factor = np.broadcast_to(np.asarray(scale, dtype=float), self.volumes_m3.shape)
        gradients = self.gradients.copy()
        gradients[:, :, 2] /= factor[:, :, None]
        return replace(self, gradients=gradients, volumes_m3=self.volumes_m3 * factor)

    def places(self, places: Places) -> Places:
        """The places of :attr:`pairs`, element by element (elements, width, width, 3)."""
        count, width = self.mesh.connectivity.shape
        return places.reshape(count, width, width, 3)

    def now_m(self, positions_m: Floats) -> Floats:
        """Where the points lie (elements, points, 3) when the nodes lie at ``positions_m``."""
        return np.einsum("qa,eai->eqi", self.values, positions_m[self.mesh.connectivity])

    def deformation(self, positions_m: Floats) -> Floats:
        """Deformation gradients (elements, points, 3, 3)."""
        F = np.empty((*self.volumes_m3.shape, 3, 3))
        integration.deformations(positions_m, self.mesh.connectivity, self.gradients, F)
        return F

    def nodal(self, stress_pa: Floats) -> Floats:
        """Gradient (nodes, 3) [N] that first Piola stresses (elements, points, 3, 3) make."""
        gradient = np.zeros_like(self.mesh.nodes_m)
        integration.add_nodal_forces(
            stress_pa, self.mesh.connectivity, self.gradients, self.volumes_m3, gradient
        )
        return gradient

    def nodal_volumes_m3(self) -> Floats:
        """Share (nodes,) of each node in the volume: the integrals of the shape functions.

        Some are negative on quadratic elements; loads are consistent only so.
        """
        shares = np.zeros(len(self.mesh.nodes_m))
        np.add.at(shares, self.mesh.connectivity, self.volumes_m3 @ self.values)
        return shares


def _element_pairs(connectivity: Integers) -> Integers:
    width = connectivity.shape[1]
    rows = np.repeat(connectivity, width, axis=1).ravel()
    return np.column_stack([rows, np.tile(connectivity, (1, width)).ravel()])


class MaterialTerm(ABC):
    """Base of an energy density of the deformation gradient, beside the base material.

    A term says what happens at points, all of them at once: F comes as (elements, points, 3, 3).
    A subclass is a frozen dataclass with ``name`` and ``points``, those of the body that it belongs
    to, among its fields. A term that ``is_nothing`` is there for its derivatives only.
    """

    name: str
    points: MaterialPoints
    parameters: tuple[str, ...] = ()

    @abstractmethod
    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        """Energy density (elements, points) [J/m^3] and first Piola stress P, shaped as F [Pa]."""

    @abstractmethod
    def stress_tangent(self, F: Floats) -> Floats:
        """dP/dF (elements, points, 9, 9) [Pa], row 3 i + J and column 3 k + L; symmetric."""

    @property
    def is_nothing(self) -> bool:
        """Whether it has no energy whatever the deformation."""
        return False

    def scaled(self, factor: float) -> MaterialTerm:
        """The same with ``factor`` times the energy.

        Raises:
            TypeError: the term cannot.
        """
        raise TypeError(f"{type(self).__name__} {self.name!r} has no scaled()")

    def stress_by(self, parameter: str, F: Floats) -> Floats:
        """Derivative of P by a parameter at fixed F; a term with parameters overrides this."""
        raise unknown_parameter(self, parameter)

    @property
    def pairs(self) -> Integers:
        return self.points.pairs

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        if self.is_nothing:
            return 0.0, np.zeros_like(positions_m)
        density, stress = self.density_and_stress(self.points.deformation(positions_m))
        return float(np.sum(density * self.points.volumes_m3)), self.points.nodal(stress)

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        if self.is_nothing:
            return
        tangents = self.stress_tangent(self.points.deformation(positions_m))
        integration.add_stiffness(
            np.ascontiguousarray(tangents),
            self.points.gradients,
            self.points.volumes_m3,
            self.points.places(places),
            entries,
        )

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        stress = self.stress_by(parameter, self.points.deformation(positions_m))
        return self.points.nodal(stress)
