"""What an equilibrium says: forces, moments, stress, surface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from defras_sim.geometry import Floats
from defras_sim.tissue import integration
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.discs import net_force
from defras_sim.tissue.grasp import Grasp, term_name
from defras_sim.tissue.material_points import MaterialTerm
from defras_sim.tissue.springs import SpringTerm
from defras_sim.tissue.state import TissueState, Wrench
from defras_sim.tissue.surface import SurfaceMap
from defras_sim.tissue.terms import Term


def tissue_state(
    terms: Iterable[Term],
    attachments: SpringTerm,
    grasps: Mapping[str, Grasp],
    positions_m: Floats,
    surface: SurfaceMap,
    *,
    converged: bool,
    iterations: int,
) -> TissueState:
    """Read everything off the equilibrium ``positions_m`` (nodes, 3) of ``terms``."""
    terms = list(terms)
    forces, moments = {}, {}
    springs = {term.name: term for term in terms if isinstance(term, SpringTerm)}
    for arm, grasp in grasps.items():
        pull = springs[term_name(arm)].forces_n(positions_m)
        forces[arm] = grasp.force_n(pull)
        moments[arm] = grasp.moment_nm(pull, grasp.springs.rows @ positions_m)
    energy_j, wrenches = 0.0, {}
    for term in terms:
        energy, gradient = term.energy_and_gradient(positions_m)
        if isinstance(term, ElasticBody | MaterialTerm):
            energy_j += energy
        else:
            if isinstance(term, SpringTerm):
                energy_j += term.strain_energy_j(positions_m)
            wrenches[term.name] = Wrench.of(-gradient, positions_m)
    stress_pa, stress_at_m = largest_principal_stress(terms, positions_m)
    return TissueState(
        nodes_m=positions_m.copy(),
        surface=surface.surface(positions_m),
        grasp_forces_n=forces,
        grasp_moments_nm=moments,
        attachment_forces_n=net_force(attachments.forces_n(positions_m)),
        largest_principal_stress_pa=stress_pa,
        stress_at_m=stress_at_m,
        strain_energy_j=energy_j,
        converged=converged,
        iterations=iterations,
        wrenches=wrenches,
    )


def largest_principal_stress(terms: Iterable[Term], positions_m: Floats) -> tuple[float, Floats]:
    """Largest principal Cauchy stress [Pa] of all material terms together, and where (3,) it acts.

    Raises:
        ValueError: none of ``terms`` is a material.
    """
    parts = [term for term in terms if isinstance(term, ElasticBody | MaterialTerm)]
    if not parts:
        raise ValueError("stress needs a material among the terms")
    points = parts[0].points
    F = points.deformation(positions_m)
    P = parts[0].density_and_stress(F)[1]
    for term in parts[1:]:
        if not term.is_nothing:
            P = P + term.density_and_stress(F)[1]
    largest, element, point = integration.largest_principal_stress(F, P)
    corners = positions_m[points.mesh.connectivity[element]]
    return largest, points.values[point] @ corners
