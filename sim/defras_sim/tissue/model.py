"""The tissue model: one soft slab, held from below by attachments and from above by grasps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ElementName, MaterialName, Scene
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.bed import bed_under
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import (
    Grasp,
    NothingToGrasp,
    at_rest,
    grasped_patch,
    nearest_on_upper_face,
    spring_order,
)
from defras_sim.tissue.hole_response import HoleResponse
from defras_sim.tissue.holes import Holes
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Integers, slab_mesh
from defras_sim.tissue.path import length_m
from defras_sim.tissue.readout import tissue_state
from defras_sim.tissue.solver import NewtonSettings, NewtonSolver
from defras_sim.tissue.springs import ROWS, joined
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.surface import surface_map
from defras_sim.tissue.travel import Tips, Traveller

__all__ = ["NothingToGrasp", "TissueModel", "TissueSnapshot"]


@dataclass(frozen=True)
class TissueSnapshot:
    """Everything a :class:`TissueModel` needs to go on from here."""

    positions_m: Floats
    grasps: Mapping[str, Grasp]


class TissueModel:
    """Quasi-static tissue of a scene. Not thread-safe; use one model a thread."""

    def __init__(
        self,
        scene: Scene,
        *,
        element: ElementName | None = None,
        elements_xyz: tuple[int, int, int] | None = None,
        material: MaterialName | None = None,
        residual_share: float = 5e-6,
    ) -> None:
        tissue = scene.tissue
        self.scene = scene
        self.mesh = slab_mesh(
            tissue, element or tissue.element, elements_xyz or tissue.elements_xyz
        )
        name = material or tissue.material
        mu, lam = lame_parameters(name, tissue.young_modulus_pa, tissue.poisson_ratio)
        self._body = ElasticBody(self.mesh, name, mu, lam)
        self._bed = bed_under(self.mesh, tissue) if tissue.bed else None
        self._surface = surface_map(self.mesh, tissue)
        self._holes = Holes(self.mesh, scene)
        self._positions_m = self.mesh.nodes_m.copy()
        self._grasps: dict[str, Grasp] = {}
        self._energy = self._assembled()
        self._solver = NewtonSolver(NewtonSettings(residual_share * self._energy.force_scale_n()))
        self._traveller = Traveller(self._solver, self._energy_at)

    @property
    def hole_stiffness_n_per_m(self) -> Floats:
        """Stiffness of every hole (holes,), in the order of ``scene.holes_xy_m``."""
        return self._holes.stiffness_n_per_m

    def set_hole_stiffness(self, stiffness_n_per_m: Floats) -> None:
        """Give every hole its stiffness (holes,); zero is free.

        Raises:
            ValueError: wrong count, negative, or not finite.
        """
        self._holes.stiffness_n_per_m = stiffness_n_per_m
        self._changed()

    @property
    def grasped_arms(self) -> tuple[str, ...]:
        return tuple(self._grasps)

    def grasp(self, arm: str, tissue_from_tip: Pose) -> None:
        """Take hold of the disc of the upper face that lies nearest to the tip as things stand.

        Raises:
            NothingToGrasp: the tip is farther than 8 mm from the upper face.
            ValueError: the arm holds tissue already.
        """
        if arm in self._grasps:
            raise ValueError(f"{arm} holds tissue already; release it first")
        surface = self._surface.surface(self._positions_m)
        center = nearest_on_upper_face(
            self.mesh, self._positions_m, surface, tissue_from_tip.position_m
        )
        radius = self.scene.grasp.patch_radius_m
        self._grasps[arm] = grasped_patch(
            self.mesh, self._positions_m, center, radius, tissue_from_tip
        )
        self._changed()

    def release(self, arm: str) -> None:
        """Let go. Without any grasp nothing loads the tissue, and it returns to rest.

        Raises:
            ValueError: the arm holds nothing.
        """
        if arm not in self._grasps:
            raise ValueError(f"{arm} holds no tissue; holding: {', '.join(self._grasps) or 'none'}")
        del self._grasps[arm]
        if not self._grasps:
            self._positions_m = self.mesh.nodes_m.copy()
        self._changed()

    def reset(self) -> None:
        """Rest shape, nothing grasped."""
        self.restore(TissueSnapshot(self.mesh.nodes_m, {}))

    def snapshot(self) -> TissueSnapshot:
        return TissueSnapshot(self._positions_m.copy(), dict(self._grasps))

    def restore(self, snapshot: TissueSnapshot) -> None:
        """Go back to ``snapshot``; the holes keep their present stiffness."""
        others = spring_order(snapshot.grasps) != spring_order(self._grasps)
        self._grasps = dict(snapshot.grasps)
        if others:
            self._changed()
        self._place(snapshot)

    def solve(self, tips: Tips) -> TissueState:
        """Equilibrium with each holding arm's tip at its pose in ``tips``.

        Where other holes hold than before, the way may have to start again from rest. If that does
        not help, the state is the last good one, marked as not converged.

        Raises:
            ValueError: a holding arm has no pose, a pose is not finite, or an arm holds nothing.
        """
        self._check(tips)
        before = self.snapshot()
        moving = length_m(self._tips(), tips) > 0
        converged, iterations = self._travel(tips)
        if not converged and not moving:
            self._place(TissueSnapshot(self.mesh.nodes_m, at_rest(self._grasps)))
            converged, more = self._travel(tips)
            iterations += more
            if not converged:
                self._place(before)
        return self._state(converged, iterations)

    def response_to_hole_forces(self, holes: Integers) -> HoleResponse:
        """Linear response of the surface and of ``holes`` to forces where ``holes`` hold."""
        x = self._positions_m
        rows, targets_m = self._holes.rows_of(holes)
        on_holes = rows.toarray()
        stretch = on_holes @ x - targets_m
        motion = self._solver.solve_tangent(self._energy.tangent(x), np.kron(on_holes.T, np.eye(3)))
        by_node = motion.reshape(len(x), -1)
        count, size = len(holes), 3 * ROWS
        return HoleResponse(
            (self._surface.from_nodes @ by_node).reshape(-1, 3, count, size),
            (on_holes @ by_node).reshape(count, size, count, size),
            stretch.reshape(count, size),
        )

    def _changed(self) -> None:
        """What holds the tissue is different from now on."""
        self._traveller.forget()
        self._energy = self._assembled()

    def _assembled(self) -> PotentialEnergy:
        springs = [self._holes.springs, *(grasp.springs for grasp in self._grasps.values())]
        return PotentialEnergy(self._body, joined(springs), self._targets_m(), self._bed)

    def _targets_m(self) -> Floats:
        held = [grasp.targets_m for grasp in self._grasps.values()]
        return np.concatenate([self._holes.targets_m, *held])

    def _tips(self) -> dict[str, Pose]:
        return {arm: grasp.tissue_from_tip for arm, grasp in self._grasps.items()}

    def _place(self, snapshot: TissueSnapshot) -> None:
        self._positions_m = snapshot.positions_m.copy()
        self._grasps = dict(snapshot.grasps)
        self._energy.targets_m = self._targets_m()
        self._traveller.forget()

    def _travel(self, tips: Tips) -> tuple[bool, int]:
        """Go towards ``tips`` as far as there are equilibria; (arrived, iterations)."""
        arrival = self._traveller.go(self._positions_m, self._tips(), tips)
        self._positions_m = arrival.positions_m
        self._energy_at(arrival.tips)
        return arrival.arrived, arrival.iterations

    def _energy_at(self, tips: Tips) -> PotentialEnergy:
        """The energy with each holding arm's tip at its pose in ``tips``."""
        self._grasps = {
            arm: replace(grasp, tissue_from_tip=tips[arm]) for arm, grasp in self._grasps.items()
        }
        self._energy.targets_m = self._targets_m()
        return self._energy

    def _check(self, tips: Tips) -> None:
        if set(tips) != set(self._grasps):
            raise ValueError(
                f"tips given for {sorted(tips)}; tissue is held by {sorted(self._grasps)}"
            )
        for arm, pose in tips.items():
            if not (np.all(np.isfinite(pose.position_m)) and np.all(np.isfinite(pose.rotation))):
                raise ValueError(f"the pose of {arm} is not finite: {pose}")

    def _state(self, converged: bool, iterations: int) -> TissueState:
        return tissue_state(
            self._energy, self._positions_m, self._grasps, self._surface, converged, iterations
        )
