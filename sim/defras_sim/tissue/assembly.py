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

_SCALE, _POISSON = "stiffness_scale", "poisson_ratio"


class ElasticBody:
    """A mesh of one hyperelastic material. Positions are (nodes, 3); nothing is kept between calls.

    ``mu_pa`` and ``lam_pa`` (elements, points) are the material's own parameters, see
    :func:`defras_sim.tissue.materials.lame_parameters`; given as one number, or one an element
    (elements, 1), they are spread over the quadrature points.

    Parameters: ``stiffness_scale`` multiplies both; ``poisson_ratio`` changes at fixed Young's
    modulus; every one of ``modes`` (elements, points) is a field by which the stiffness grows: a
    mode's strength s makes it 1 + s mode times as stiff, and derivatives are taken at s = 0.
    """

    name = "material"

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
        return (_SCALE, _POISSON, *self.modes)

    @property
    def pairs(self) -> Integers:
        return self.points.pairs

    def with_lame(self, mu_pa: float | Floats, lam_pa: float | Floats) -> ElasticBody:
        """The same body with other parameters of its material."""
        return ElasticBody(
            self.mesh, self.material, mu_pa, lam_pa, modes=self.modes, points=self.points
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
        if parameter == _POISSON:
            mu_by, lam_by = materials.lame_by_poisson(self.material, self.mu_pa, self.lam_pa)
            # A step as large as the moduli, so that the difference below keeps its digits.
            unit = float(np.mean(self.mu_pa + self.lam_pa) / np.mean(np.abs(mu_by) + lam_by))
        elif parameter == _SCALE:
            return self.energy_and_gradient(positions_m)[1]
        elif parameter in self.modes:
            unit, field = 1.0, self.modes[parameter]
            mu_by, lam_by = field * self.mu_pa, field * self.lam_pa
        else:
            raise unknown_parameter(self, parameter)
        # All materials are linear in their two parameters, so a difference is the derivative.
        _, more = self._energy_and_gradient(
            positions_m, self.mu_pa + unit * mu_by, self.lam_pa + unit * lam_by
        )
        return (more - self.energy_and_gradient(positions_m)[1]) / unit

    def stress_pa(self, F: Floats) -> Floats:
        """First Piola stress of deformation gradients F (elements, points, 3, 3)."""
        stress = np.empty_like(F)
        kernels.stresses(self._code, F, self.mu_pa, self.lam_pa, stress)
        return stress

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
