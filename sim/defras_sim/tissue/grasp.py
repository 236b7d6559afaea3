"""A jaw's hold on the tissue: which patch it takes, and where the patch goes with the tip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats, Pose
from defras_sim.rest_shape import Face
from defras_sim.surface import Surface
from defras_sim.tissue.dent import Dent
from defras_sim.tissue.discs import ROW_SHIFTS, disc_rows
from defras_sim.tissue.mesh import Integers, Mesh, SlabMesh
from defras_sim.tissue.springs import Springs, SpringTerm
from defras_sim.tissue.unresolved import DentsOf

# Stiff enough that a patch under 1 N gives 0.1 mm, soft enough not to spoil the conditioning.
GRASP_N_PER_M = 1e4
GRASP_REACH_M = 0.008


class NothingToGrasp(ValueError):
    """The jaw closed where there is no tissue."""


@dataclass(frozen=True)
class Grasp:
    """A held patch: its springs, and their targets (rows, 3) as seen from the tip.

    ``shifts`` (rows,) says how each held quantity moves with a translation: 1 for positions, 0 for
    moments.
    """

    springs: Springs
    shifts: Floats
    tip_targets_m: Floats
    tissue_from_tip: Pose

    @property
    def targets_m(self) -> Floats:
        pose = self.tissue_from_tip
        return self.tip_targets_m @ pose.rotation.T + self.shifts[:, None] * pose.position_m

    def targets_by_tip_m(self) -> Floats:
        """Derivatives (rows, 3, 6) of the targets by the tip's translation, then by its rotation
        [rad] about itself, both along the axes of the tissue frame."""
        seen = self.tip_targets_m @ self.tissue_from_tip.rotation.T
        moved = self.shifts[:, None, None] * np.eye(3)
        turned = np.stack([np.cross(axis, seen) for axis in np.eye(3)], axis=2)
        return np.concatenate([moved, turned], axis=2)

    def term(self, arm: str) -> SpringTerm:
        """The boundary term by which ``arm`` holds the tissue."""
        return SpringTerm(term_name(arm), self.springs, self.targets_m)

    def unloaded_tip(self, positions_m: Floats) -> Pose:
        """Where the tip holds tissue whose nodes lie at ``positions_m`` without pulling at it."""
        held = np.asarray(self.springs.rows @ positions_m)
        moved = _nearest_motion if np.all(self.shifts == 1.0) else _patch_motion
        return moved(self.tip_targets_m, held)

    def force_n(self, forces_n: Floats) -> Floats:
        """Net force (3,) on the tissue of the springs' forces (rows, 3)."""
        return self.shifts @ forces_n

    def moment_nm(self, forces_n: Floats, held_m: Floats) -> Floats:
        """Their moment (3,) about the tip, where the held quantities are ``held_m`` (rows, 3)."""
        levers = held_m - self.shifts[:, None] * self.tissue_from_tip.position_m
        return np.cross(levers, forces_n).sum(axis=0)


def term_name(arm: str) -> str:
    """What the boundary term of an arm's grasp is called."""
    return f"grasp of {arm}"


def grasped_patch(
    mesh: Mesh,
    upper: Face,
    positions_m: Floats,
    center_xy_m: Floats,
    radius_m: float,
    tissue_from_tip: Pose,
    dents: DentsOf,
) -> Grasp:
    """Hold the disc around rest position ``center_xy_m`` (2,) of the upper face as it lies now.

    The disc is moved inwards where it would reach over the rim. Linear tetrahedra are held
    by whole nodes instead, as PyBullet holds them.
    """
    if isinstance(mesh, SlabMesh) and mesh.element == "tetrahedron4":
        nodes = nodes_under_jaw(mesh, center_xy_m, radius_m)
        rows = sparse.csr_array(sparse.eye_array(len(mesh.nodes_m), format="csr")[nodes])
        shifts, dent = np.ones(len(nodes)), Dent.none(len(nodes))
    else:
        center = upper.inset(center_xy_m, radius_m)
        rows, shifts = disc_rows(mesh, center[None], radius_m, upper), ROW_SHIFTS
        dent = dents.at(center[None], radius_m, upper=True)
    held = rows @ positions_m
    from_tip = held - shifts[:, None] * tissue_from_tip.position_m
    springs = Springs(rows, np.full(len(shifts), GRASP_N_PER_M), dent)
    return Grasp(springs, shifts, from_tip @ tissue_from_tip.rotation, tissue_from_tip)


def nodes_under_jaw(mesh: SlabMesh, center_xy_m: Floats, radius_m: float) -> Integers:
    """Nodes of both faces within the jaw's radius and half a cell of rest position (2,).

    Half a cell more than the radius always gives enough columns of nodes to hold an orientation.
    """
    away_m = np.linalg.norm(mesh.nodes_m[:, :2] - center_xy_m, axis=1)
    return np.flatnonzero(away_m <= radius_m + float(np.max(mesh.cell_m[:2])) / 2 + 1e-6)


def _nearest_motion(rest_m: Floats, now_m: Floats) -> Pose:
    """Rigid motion that brings ``rest_m`` (n, 3) nearest to ``now_m`` (n, 3)."""
    rest_mean, now_mean = rest_m.mean(axis=0), now_m.mean(axis=0)
    rotation = Rotation.align_vectors(now_m - now_mean, rest_m - rest_mean)[0].as_matrix()
    return Pose(now_mean - rotation @ rest_mean, rotation)


def _patch_motion(rest_m: Floats, now_m: Floats) -> Pose:
    """Rigid motion nearest to a disc's deformation, from its mean and moments (3, 3)."""

    def frame(held: Floats) -> Floats:
        x = held[1] / np.linalg.norm(held[1])
        z = np.cross(x, held[2])
        z /= np.linalg.norm(z)
        return np.column_stack([x, np.cross(z, x), z])

    rotation = frame(now_m) @ frame(rest_m).T
    return Pose(now_m[0] - rotation @ rest_m[0], rotation)


def nearest_on_upper_face(
    mesh: Mesh, upper: Face, positions_m: Floats, surface: Surface, tip_m: Floats
) -> Floats:
    """Rest position (2,) of the point of the upper face that now lies nearest to the tip.

    Raises:
        NothingToGrasp: it is farther than 8 mm from the tip.
    """
    seen = surface.vertices_m[surface.upper]
    best = surface.rest_xy_m[surface.upper][np.argmin(np.linalg.norm(seen - tip_m, axis=1))]
    width, gap = 0.004, np.inf
    for _ in range(8):  # halve a grid around the nearest vertex, down to 0.03 mm
        line = np.linspace(-width, width, 5)
        around = best + np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        rest = upper.at(around)
        distances = np.linalg.norm(mesh.interpolation(rest) @ positions_m - tip_m, axis=1)
        nearest = int(np.argmin(distances))
        best, gap = rest[nearest, :2], float(distances[nearest])
        width /= 2
    if gap > GRASP_REACH_M:
        raise NothingToGrasp(
            f"the tip at {np.round(tip_m, 4)} m is {1e3 * gap:.1f} mm from the tissue's upper "
            f"face; a grasp needs at most {1e3 * GRASP_REACH_M:.0f} mm"
        )
    return best


def unloaded(grasps: Mapping[str, Grasp], positions_m: Floats) -> dict[str, Grasp]:
    """The same grasps where they do not pull at tissue that lies at ``positions_m``."""
    return {
        arm: replace(grasp, tissue_from_tip=grasp.unloaded_tip(positions_m))
        for arm, grasp in grasps.items()
    }


def spring_order(grasps: Mapping[str, Grasp]) -> list[tuple[str, int]]:
    """Which springs hold, in which order: equal if the same energy describes them."""
    return [(arm, id(grasp.springs)) for arm, grasp in grasps.items()]
