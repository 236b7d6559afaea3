"""The tissue model: one soft slab, held from below by attachments and from above by grasps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import RIGID_HOLE_N_PER_M, ElementName, MaterialName, Scene
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.hole_response import HoleResponse
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Integers, slab_mesh
from defras_sim.tissue.solver import NewtonSettings, NewtonSolver
from defras_sim.tissue.springs import (
    ROW_SHIFTS,
    ROWS,
    Springs,
    disc_rows,
    joined,
    net_force,
    net_moment,
)
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.surface import surface_map

# Stiff enough that a patch under 1 N gives 0.1 mm, soft enough not to spoil the conditioning.
GRASP_N_PER_M = 1e4
GRASP_REACH_M = 0.008
# Of the tip between two equilibria on the way to a far one; and of Newton's method on that way.
MAX_TIP_STEP_M = 0.004
MAX_ITERATIONS = 200


@dataclass(frozen=True)
class Grasp:
    """A held patch: its springs, and their targets (3, 3) as seen from the tip."""

    springs: Springs
    tip_targets_m: Floats
    tissue_from_tip: Pose

    def targets_m(self) -> Floats:
        pose = self.tissue_from_tip
        return self.tip_targets_m @ pose.rotation.T + ROW_SHIFTS[:, None] * pose.position_m


@dataclass(frozen=True)
class TissueSnapshot:
    """Everything a :class:`TissueModel` needs to go on from here."""

    positions_m: Floats
    grasps: Mapping[str, Grasp]


class NothingToGrasp(ValueError):
    """The jaw closed where there is no tissue."""


class TissueModel:
    """Quasi-static tissue of a scene. Not thread-safe; use one model a thread."""

    def __init__(
        self,
        scene: Scene,
        *,
        element: ElementName | None = None,
        elements_xyz: tuple[int, int, int] | None = None,
        material: MaterialName | None = None,
        residual_share: float = 1e-6,
    ) -> None:
        tissue = scene.tissue
        self.scene = scene
        self.mesh = slab_mesh(
            tissue, element or tissue.element, elements_xyz or tissue.elements_xyz
        )
        name = material or tissue.material
        mu, lam = lame_parameters(name, tissue.young_modulus_pa, tissue.poisson_ratio)
        self._body = ElasticBody(self.mesh, name, mu, lam)
        self._surface = surface_map(self.mesh, tissue)
        self._hole_rows = disc_rows(
            self.mesh, scene.holes_xy_m, scene.attachments.hole_radius_m, -tissue.thickness_m
        )
        self._hole_targets_m = self._hole_rows @ self.mesh.nodes_m
        self._hole_stiffness = np.where(scene.attached, RIGID_HOLE_N_PER_M, 0.0)
        self._positions_m = self.mesh.nodes_m.copy()
        self._grasps: dict[str, Grasp] = {}
        self._energy = self._assembled()
        self._solver = NewtonSolver(NewtonSettings(residual_share * self._energy.force_scale_n()))

    @property
    def hole_stiffness_n_per_m(self) -> Floats:
        """Stiffness of every hole (holes,), in the order of ``scene.holes_xy_m``."""
        return self._hole_stiffness.copy()

    def set_hole_stiffness(self, stiffness_n_per_m: Floats) -> None:
        """Give every hole its stiffness (holes,); zero is free.

        Raises:
            ValueError: wrong count, negative, or not finite.
        """
        stiffness = np.array(stiffness_n_per_m, dtype=float)
        if stiffness.shape != self._hole_stiffness.shape:
            raise ValueError(
                f"hole stiffness has shape {stiffness.shape}; the scene has "
                f"{len(self._hole_stiffness)} holes"
            )
        if not np.all(np.isfinite(stiffness) & (stiffness >= 0)):
            raise ValueError("hole stiffness should be finite and at least 0 N/m")
        self._hole_stiffness = stiffness
        self._energy = self._assembled()

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
        center = self._nearest_upper_point(tissue_from_tip.position_m)
        radius = self.scene.grasp.patch_radius_m
        half = np.array([self.scene.tissue.length_x_m, self.scene.tissue.width_y_m]) / 2
        center = np.clip(center, radius - half, half - radius)
        rows = disc_rows(self.mesh, center[None], radius, 0.0)
        springs = Springs(rows, np.full(ROWS, GRASP_N_PER_M))
        shifted = rows @ self._positions_m - ROW_SHIFTS[:, None] * tissue_from_tip.position_m
        held = shifted @ tissue_from_tip.rotation
        self._grasps[arm] = Grasp(springs, held, tissue_from_tip)
        self._energy = self._assembled()

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
        self._solver.forget()
        self._energy = self._assembled()

    def reset(self) -> None:
        """Rest shape, nothing grasped."""
        self.restore(TissueSnapshot(self.mesh.nodes_m, {}))

    def snapshot(self) -> TissueSnapshot:
        return TissueSnapshot(self._positions_m.copy(), dict(self._grasps))

    def restore(self, snapshot: TissueSnapshot) -> None:
        """Go back to ``snapshot``; the holes keep their present stiffness."""
        self._positions_m = snapshot.positions_m.copy()
        self._grasps = dict(snapshot.grasps)
        self._solver.forget()
        self._energy = self._assembled()

    def solve(self, tips: Mapping[str, Pose]) -> TissueState:
        """Equilibrium with each holding arm's tip at its pose in ``tips`` (tissue_from_tip).

        Long ways are gone in steps of some millimetres, halved where a step fails. If that does
        not help, the state is the last good one on the way, marked as not converged.

        Raises:
            ValueError: a holding arm has no pose, a pose is not finite, or an arm holds nothing.
        """
        self._check(tips)
        starts = {arm: grasp.tissue_from_tip for arm, grasp in self._grasps.items()}
        share, iterations, converged = 0.0, 0, True
        longest = max([_distance(starts[arm], tips[arm]) for arm in starts], default=0.0)
        step = 1.0 / max(1.0, np.ceil(longest / MAX_TIP_STEP_M))
        smallest = step / 32
        while True:
            aim = min(1.0, share + step)
            before = self._positions_m, dict(self._grasps)
            for arm, start in starts.items():
                self._move_tip(arm, _between(start, tips[arm], aim))
            self._energy.targets_m = self._targets_m()
            solution = self._solver.minimise(self._energy, self._positions_m)
            iterations += solution.iterations
            if solution.converged:
                self._positions_m = solution.positions_m
                share, step = aim, step * 1.5
                if share >= 1.0:
                    break
                if iterations <= MAX_ITERATIONS:
                    continue
                converged = False
                break
            self._positions_m, self._grasps = before
            self._solver.forget()
            step *= 0.5
            if step < smallest or iterations > MAX_ITERATIONS:
                converged = False
                break
        self._energy.targets_m = self._targets_m()
        return self._state(converged, iterations)

    def surface_sensitivity_to_holes(self, holes: Integers) -> Floats:
        """Derivative (vertices, 3, len(holes)) [m per N/m] of the surface by the holes' stiffness.

        At an equilibrium the gradient g(x, k) stays zero, so dx/dk = -K^-1 dg/dk.
        """
        x = self._positions_m
        stretch = self._hole_rows @ x - self._hole_targets_m
        columns = np.zeros((x.size, len(holes)))
        for column, hole in enumerate(np.asarray(holes, dtype=np.int64)):
            rows = slice(ROWS * hole, ROWS * (hole + 1))
            columns[:, column] = (self._hole_rows[rows].T @ stretch[rows]).ravel()
        change = -self._solver.solve_tangent(self._energy.tangent(x), columns)
        by_node = change.reshape(len(x), 3 * len(holes))
        surface = self._surface.from_nodes @ by_node
        return surface.reshape(-1, 3, len(holes))

    def response_to_hole_forces(self, holes: Integers) -> HoleResponse:
        """Linear response of the surface and of ``holes`` to a force at each of ``holes``."""
        x = self._positions_m
        chosen = np.asarray(holes, dtype=np.int64)
        means = ROWS * chosen
        on_holes = self._hole_rows[means].toarray()
        stretch = on_holes @ x - self._hole_targets_m[means]
        forces = np.kron(on_holes.T, np.eye(3))
        motion = self._solver.solve_tangent(self._energy.tangent(x), forces)
        by_node = motion.reshape(len(x), -1)
        shape = (3, len(chosen), 3)
        return HoleResponse(
            (self._surface.from_nodes @ by_node).reshape(-1, *shape),
            (on_holes @ by_node).reshape(-1, *shape),
            stretch,
        )

    def _assembled(self) -> PotentialEnergy:
        springs = [Springs(self._hole_rows, np.repeat(self._hole_stiffness, ROWS))]
        springs += [grasp.springs for grasp in self._grasps.values()]
        return PotentialEnergy(self._body, joined(springs), self._targets_m())

    def _targets_m(self) -> Floats:
        held = [grasp.targets_m() for grasp in self._grasps.values()]
        return np.concatenate([self._hole_targets_m, *held])

    def _move_tip(self, arm: str, tissue_from_tip: Pose) -> None:
        self._grasps[arm] = replace(self._grasps[arm], tissue_from_tip=tissue_from_tip)

    def _nearest_upper_point(self, tip_m: Floats) -> Floats:
        """Rest position (2,) of the point of the upper face that is now nearest to the tip."""
        surface = self._surface.surface(self._positions_m)
        vertices = surface.vertices_m[surface.upper]
        distances = np.linalg.norm(vertices - tip_m, axis=1)
        nearest = int(np.argmin(distances))
        rest = surface.rest_xy_m[surface.upper]
        best, gap = _refine(self, rest[nearest], tip_m)
        if gap > GRASP_REACH_M:
            raise NothingToGrasp(
                f"the tip at {np.round(tip_m, 4)} m is {1e3 * gap:.1f} mm from the tissue's upper "
                f"face; a grasp needs at most {1e3 * GRASP_REACH_M:.0f} mm"
            )
        return best

    def _check(self, tips: Mapping[str, Pose]) -> None:
        if set(tips) != set(self._grasps):
            raise ValueError(
                f"tips given for {sorted(tips)}; tissue is held by {sorted(self._grasps)}"
            )
        for arm, pose in tips.items():
            if not (np.all(np.isfinite(pose.position_m)) and np.all(np.isfinite(pose.rotation))):
                raise ValueError(f"the pose of {arm} is not finite: {pose}")

    def _state(self, converged: bool, iterations: int) -> TissueState:
        x = self._positions_m
        springs, targets = self._energy.springs, self._energy.targets_m
        forces = springs.forces(x, targets)
        held = springs.rows @ x
        holes = len(self._hole_stiffness) * ROWS
        grasp_forces, grasp_moments = {}, {}
        for number, (arm, grasp) in enumerate(self._grasps.items()):
            mine = slice(holes + number * ROWS, holes + (number + 1) * ROWS)
            tip_m = grasp.tissue_from_tip.position_m
            grasp_forces[arm] = net_force(forces[mine])[0]
            grasp_moments[arm] = net_moment(forces[mine], held[mine], tip_m)[0]
        peak = self._body.largest_principal_stress(x)
        return TissueState(
            nodes_m=x.copy(),
            surface=self._surface.surface(x),
            grasp_forces_n=grasp_forces,
            grasp_moments_nm=grasp_moments,
            attachment_forces_n=net_force(forces[:holes]),
            largest_principal_stress_pa=peak.largest_pa,
            stress_at_m=peak.position_m,
            strain_energy_j=self._body.energy_and_gradient(x)[0],
            converged=converged,
            iterations=iterations,
        )


def _refine(model: TissueModel, rest_xy_m: Floats, tip_m: Floats) -> tuple[Floats, float]:
    """Search around a surface vertex for the material point nearest to the tip."""
    half = np.array([model.scene.tissue.length_x_m, model.scene.tissue.width_y_m]) / 2
    best = rest_xy_m
    gap = np.inf
    width = 0.004
    for _ in range(8):
        line = np.linspace(-width, width, 5)
        around = best + np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        around = np.clip(around, -half, half)
        points = np.column_stack([around, np.zeros(len(around))])
        positions = model.mesh.interpolation(points) @ model._positions_m
        distances = np.linalg.norm(positions - tip_m, axis=1)
        nearest = int(np.argmin(distances))
        best, gap = around[nearest], float(distances[nearest])
        width *= 0.5
    return best, gap


def _distance(start: Pose, end: Pose) -> float:
    """Length of a tip's way [m]; a turn counts as the way of a point 20 mm off."""
    turn = Rotation.from_matrix(end.rotation @ start.rotation.T).magnitude()
    return float(np.linalg.norm(end.position_m - start.position_m)) + 0.02 * float(turn)


def _between(start: Pose, end: Pose, share: float) -> Pose:
    if share >= 1.0:
        return end
    turn = Rotation.from_matrix(end.rotation @ start.rotation.T).as_rotvec()
    rotation = Rotation.from_rotvec(share * turn).as_matrix() @ start.rotation
    return Pose(start.position_m + share * (end.position_m - start.position_m), rotation)
