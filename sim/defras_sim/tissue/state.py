"""What a solved tissue model says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from defras_sim.geometry import Floats
from defras_sim.surface import Surface


@dataclass(frozen=True)
class TissueState:
    """One static equilibrium, in the tissue frame.

    ``nodes_m`` (n, 3). ``grasp_forces_n`` (3,) per arm: the force the jaw exerts on the tissue;
    ``grasp_moments_nm`` (3,) about the tip. ``attachment_forces_n`` (holes, 3): the force each hole
    exerts on the tissue. ``largest_principal_stress_pa`` (Cauchy) acts at ``stress_at_m`` (3,).
    ``converged`` False marks a stale state: the last good one, returned because the solve failed.
    """

    nodes_m: Floats
    surface: Surface
    grasp_forces_n: Mapping[str, Floats]
    grasp_moments_nm: Mapping[str, Floats]
    attachment_forces_n: Floats
    largest_principal_stress_pa: float
    stress_at_m: Floats
    strain_energy_j: float
    converged: bool
    iterations: int
