"""The base material: a hyperelastic body, the first of the material terms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import MaterialName
from defras_sim.tissue import kernels, materials
from defras_sim.tissue.elements import Quadrature
from defras_sim.tissue.layout import Places
from defras_sim.tissue.material_points import MaterialPoints
from defras_sim.tissue.mesh import Integers, Mesh
from defras_sim.tissue.terms import unknown_parameter

_SCALE, _POISSON, _THICKNESS = "stiffness_scale", "poisson_ratio", "thickness_scale"
# Of the difference that stands for the derivative by the thickness; its error is the square of it.
_THICKNESS_STEP = 1e-5


class ElasticBody:
    """A mesh of one hyperelastic material. Positions are (nodes, 3); nothing is kept between calls.

    ``mu_pa`` and ``lam_pa`` (elements, points) are the material's own parameters, see
    :func:`defras_sim.tissue.materials.lame_parameters`; given as one number, or one an element
    (elements, 1), they are spread over the quadrature points.

    Parameters: ``stiffness_scale`` multiplies both; ``poisson_ratio`` changes at fixed Young's
    modulus; ``thickness_scale`` multiplies the rest shape's thickness; every one of ``modes``
    (elements, points) is a field by which the stiffness grows: a mode's strength s makes it
    1 + s mode times as stiff, and derivatives are taken at s = 0.
    """

    name = "material"
    is_nothing = False

    def __init__(
        self,
        mesh: Mesh,
        material: MaterialName,
        mu_pa: float | Floats,
        lam_pa: float | Floats,
        rule: Quadrature | None = None,
        *,
        modes: Mapping[str, Floats] | None = None,
        points: MaterialPoints | None = None,
    ) -> None:
        """``points`` of another body on the same mesh and rule saves laying them out again."""
        self.mesh = mesh
        self.material: MaterialName = material
        self.points = points or MaterialPoints.of(mesh, rule or mesh.quadrature)
        shape = self.points.volumes_m3.shape
        self.mu_pa = np.broadcast_to(np.asarray(mu_pa, dtype=float), shape).copy()
        self.lam_pa = np.broadcast_to(np.asarray(lam_pa, dtype=float), shape).copy()
        self.modes = dict(modes or {})
        self._code = materials.CODES[material]

    @property
    def parameters(self) -> tuple[str, ...]:
        return (_SCALE, _POISSON, _THICKNESS, *self.modes)

    @property
    def pairs(self) -> Integers:
        return self.points.pairs

    def with_lame(self, mu_pa: float | Floats, lam_pa: float | Floats) -> ElasticBody:
        """The same body with other parameters of its material."""
        return ElasticBody(
            self.mesh, self.material, mu_pa, lam_pa, modes=self.modes, points=self.points
        )

    def scaled(self, factor: float) -> ElasticBody:
        """The same body with ``factor`` times the energy."""
        return self.with_lame(factor * self.mu_pa, factor * self.lam_pa)

    def with_modes(self, modes: Mapping[str, Floats]) -> ElasticBody:
        """The same body with further fields by which its stiffness may grow."""
        everything = {**self.modes, **modes}
        return ElasticBody(
            self.mesh, self.material, self.mu_pa, self.lam_pa, modes=everything, points=self.points
        )

    def with_points(self, points: MaterialPoints) -> ElasticBody:
        """The same material on another rest shape: see :meth:`MaterialPoints.thickened`."""
        return ElasticBody(
            self.mesh, self.material, self.mu_pa, self.lam_pa, modes=self.modes, points=points
        )

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]:
        """Elastic energy [J], infinite where the material cannot be; gradient (nodes, 3) [N]."""
        return self._energy_and_gradient(positions_m, self.mu_pa, self.lam_pa)

    def add_tangent(self, positions_m: Floats, places: Places, entries: Floats) -> None:
        """Add the second derivative, which is symmetric, to a matrix's ``entries``."""
        kernels.tangent(
            self._code,
            positions_m,
            self.mesh.connectivity,
            self.points.gradients,
            self.points.volumes_m3,
            self.mu_pa,
            self.lam_pa,
            self.points.places(places),
            entries,
        )

    def gradient_by(self, parameter: str, positions_m: Floats) -> Floats:
        if parameter == _SCALE:
            return self.energy_and_gradient(positions_m)[1]
        if parameter == _THICKNESS:
            thicker, thinner = (
                self.with_points(self.points.thickened(1 + step)).energy_and_gradient(positions_m)
                for step in (_THICKNESS_STEP, -_THICKNESS_STEP)
            )
            return (thicker[1] - thinner[1]) / (2 * _THICKNESS_STEP)
        mu_by, lam_by = self._lame_by(parameter)
        # All materials are linear in their two parameters, so a difference is the derivative; one
        # as large as the moduli keeps its digits.
        step = float(np.mean(self.mu_pa + self.lam_pa))
        step /= max(float(np.mean(np.abs(mu_by) + np.abs(lam_by))), 1e-12 * step)
        _, there = self._energy_and_gradient(
            positions_m, self.mu_pa + step * mu_by, self.lam_pa + step * lam_by
        )
        return (there - self.energy_and_gradient(positions_m)[1]) / step

    def _lame_by(self, parameter: str) -> tuple[Floats, Floats]:
        """Derivatives (elements, points) of mu and lambda."""
        if parameter == _POISSON:
            return materials.lame_by_poisson(self.material, self.mu_pa, self.lam_pa)
        if parameter in self.modes:
            return self.modes[parameter] * self.mu_pa, self.modes[parameter] * self.lam_pa
        raise unknown_parameter(self, parameter)

    @property
    def shear_pa(self) -> Floats:
        """Shear modulus (elements, points) at small strain."""
        return materials.shear_modulus_pa(self.material, self.mu_pa)

    @property
    def young_pa(self) -> Floats:
        """Young's modulus (elements, points) at small strain."""
        return materials.young_modulus_pa(self.material, self.mu_pa, self.lam_pa)

    def stress_pa(self, F: Floats) -> Floats:
        """First Piola stress of deformation gradients F (elements, points, 3, 3)."""
        return self.density_and_stress(F)[1]

    def density_and_stress(self, F: Floats) -> tuple[Floats, Floats]:
        """Energy density (elements, points) [J/m^3] and first Piola stress, shaped as F [Pa]."""
        density, stress = np.empty(F.shape[:2]), np.empty_like(F)
        kernels.stresses(self._code, F, self.mu_pa, self.lam_pa, density, stress)
        return density, stress

    def stress_tangent(self, F: Floats) -> Floats:
        """dP/dF (elements, points, 9, 9) [Pa]."""
        tangent = np.empty((*F.shape[:2], 9, 9))
        kernels.tangents(self._code, F, self.mu_pa, self.lam_pa, tangent)
        return tangent

    def force_scale_n(self) -> float:
        """A force that deforms the whole body by its own size: what residuals are compared to."""
        size = np.ptp(self.mesh.nodes_m, axis=0)
        return float(np.mean(2 * self.mu_pa) * np.prod(size) / size.max())

    def _energy_and_gradient(
        self, positions_m: Floats, mu_pa: Floats, lam_pa: Floats
    ) -> tuple[float, Floats]:
        gradient = np.zeros_like(positions_m)
        energy = kernels.energy_and_gradient(
            self._code,
            positions_m,
            self.mesh.connectivity,
            self.points.gradients,
            self.points.volumes_m3,
            mu_pa,
            lam_pa,
            gradient,
        )
        return energy, gradient
