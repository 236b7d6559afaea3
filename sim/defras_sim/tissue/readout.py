"""What an equilibrium says: forces, moments, stress, surface."""

from __future__ import annotations

from collections.abc import Mapping

from defras_sim.geometry import Floats
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import Grasp
from defras_sim.tissue.springs import net_force
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.surface import SurfaceMap


def tissue_state(
    energy: PotentialEnergy,
    positions_m: Floats,
    grasps: Mapping[str, Grasp],
    surface: SurfaceMap,
    converged: bool,
    iterations: int,
) -> TissueState:
    """The state with the nodes at ``positions_m`` (nodes, 3).

    The springs of ``energy`` are those of the holes, then those of ``grasps`` in their order.
    """
    springs = energy.springs
    forces = springs.forces(positions_m, energy.targets_m)
    held = springs.rows @ positions_m
    holes = len(forces) - sum(grasp.rows for grasp in grasps.values())
    grasp_forces, grasp_moments, first = {}, {}, holes
    for arm, grasp in grasps.items():
        mine = slice(first, first + grasp.rows)
        grasp_forces[arm] = grasp.force_n(forces[mine])
        grasp_moments[arm] = grasp.moment_nm(forces[mine], held[mine])
        first += grasp.rows
    peak = energy.body.largest_principal_stress(positions_m)
    return TissueState(
        nodes_m=positions_m.copy(),
        surface=surface.surface(positions_m),
        grasp_forces_n=grasp_forces,
        grasp_moments_nm=grasp_moments,
        attachment_forces_n=net_force(forces[:holes]),
        largest_principal_stress_pa=peak.largest_pa,
        stress_at_m=peak.position_m,
        strain_energy_j=energy.body.energy_and_gradient(positions_m)[0],
        converged=converged,
        iterations=iterations,
    )
