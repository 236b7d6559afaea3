"""A jaw's hold on the tissue: which patch it takes, and where the patch goes with the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.surface import Surface
from defras_sim.tissue.mesh import Mesh
from defras_sim.tissue.springs import ROW_SHIFTS, ROWS, Springs, disc_rows

# Stiff enough that a patch under 1 N gives 0.1 mm, soft enough not to spoil the conditioning.
GRASP_N_PER_M = 1e4
GRASP_REACH_M = 0.008


class NothingToGrasp(ValueError):
    """The jaw closed where there is no tissue."""


@dataclass(frozen=True)
class Grasp:
    """A held patch: its springs, and their targets (3, 3) as seen from the tip.

    ``tissue_from_rest_tip`` is where the tip would hold the patch without deforming the tissue.
    """

    springs: Springs
    tip_targets_m: Floats
    tissue_from_tip: Pose
    tissue_from_rest_tip: Pose

    @property
    def targets_m(self) -> Floats:
        pose = self.tissue_from_tip
        return self.tip_targets_m @ pose.rotation.T + ROW_SHIFTS[:, None] * pose.position_m


def grasped_disc(
    mesh: Mesh, positions_m: Floats, center_xy_m: Floats, radius_m: float, tissue_from_tip: Pose
) -> Grasp:
    """Hold the disc around rest position ``center_xy_m`` (2,) of the upper face as it lies now.

    The disc is moved inwards where it would reach over the slab's edge.
    """
    half = np.ptp(mesh.nodes_m, axis=0)[:2] / 2
    center = np.clip(center_xy_m, radius_m - half, half - radius_m)
    rows = disc_rows(mesh, center[None], radius_m, 0.0)
    held = rows @ positions_m
    from_tip = held - ROW_SHIFTS[:, None] * tissue_from_tip.position_m
    rest_tip = _patch_motion(rows @ mesh.nodes_m, held).inverse() @ tissue_from_tip
    springs = Springs(rows, np.full(ROWS, GRASP_N_PER_M))
    return Grasp(springs, from_tip @ tissue_from_tip.rotation, tissue_from_tip, rest_tip)


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
    mesh: Mesh, positions_m: Floats, surface: Surface, tip_m: Floats
) -> Floats:
    """Rest position (2,) of the point of the upper face that now lies nearest to the tip.

    Raises:
        NothingToGrasp: it is farther than 8 mm from the tip.
    """
    upper = surface.vertices_m[surface.upper]
    best = surface.rest_xy_m[surface.upper][np.argmin(np.linalg.norm(upper - tip_m, axis=1))]
    half = np.ptp(mesh.nodes_m, axis=0)[:2] / 2
    width, gap = 0.004, np.inf
    for _ in range(8):  # halve a grid around the nearest vertex, down to 0.03 mm
        line = np.linspace(-width, width, 5)
        around = best + np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        around = np.clip(around, -half, half)
        rest = np.column_stack([around, np.zeros(len(around))])
        distances = np.linalg.norm(mesh.interpolation(rest) @ positions_m - tip_m, axis=1)
        nearest = int(np.argmin(distances))
        best, gap = around[nearest], float(distances[nearest])
        width /= 2
    if gap > GRASP_REACH_M:
        raise NothingToGrasp(
            f"the tip at {np.round(tip_m, 4)} m is {1e3 * gap:.1f} mm from the tissue's upper "
            f"face; a grasp needs at most {1e3 * GRASP_REACH_M:.0f} mm"
        )
    return best
