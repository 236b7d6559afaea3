"""What a solved tissue model says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.surface import Surface


@dataclass(frozen=True)
class Wrench:
    """Net force (3,) on the tissue, and its moment (3,) about the tissue frame's origin."""

    force_n: Floats
    moment_nm: Floats

    @staticmethod
    def of(forces_n: Floats, at_m: Floats) -> Wrench:
        """Of forces (n, 3) that act at points (n, 3)."""
        turn = at_m.T @ forces_n  # (3, 3): its antisymmetric part is the moment
        moment_nm = np.array(
            [turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]]
        )
        return Wrench(np.ones(len(forces_n)) @ forces_n, moment_nm)


NO_WRENCH = Wrench(np.zeros(3), np.zeros(3))


@dataclass(frozen=True)
class TissueState:
    """One static equilibrium, in the tissue frame.

    ``nodes_m`` (n, 3). ``grasp_forces_n`` (3,) per arm: the force the jaw exerts on the tissue;
    ``grasp_moments_nm`` (3,) about the tip. ``attachment_forces_n`` (holes, 3): the force each hole
    exerts on the tissue. ``largest_principal_stress_pa`` (Cauchy) acts at ``stress_at_m`` (3,).
    ``strain_energy_j`` is that of the material. ``wrenches`` says by name what everything outside
    the tissue exerts on it: "attachments", "grasp of psm1", "bed", "gravity" and whatever else was
    plugged in; in equilibrium they add up to nothing.
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
    wrenches: Mapping[str, Wrench] = field(default_factory=dict)

    @property
    def bed_force_n(self) -> Floats:
        """Force (3,) of the bed on the tissue; zero where there is none."""
        return self.wrenches.get("bed", NO_WRENCH).force_n
