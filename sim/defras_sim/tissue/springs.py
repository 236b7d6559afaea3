"""Springs between material points and places in space: how attachments and grasps hold the tissue.

Points are interpolated in the mesh, so that refining it changes neither what is held nor how
firmly. A disc is seven such points; together they resist translation and rotation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats

# Seven-point rule of degree 5 for the mean over the unit disc (Radon 1948): the centre, and six
# points on a circle.
_ANGLES = np.arange(6) * np.pi / 3
DISC_POINTS: Floats = np.vstack(
    [np.zeros((1, 2)), np.sqrt(2 / 3) * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])]
)
DISC_WEIGHTS: Floats = np.array([0.25] + [0.125] * 6)


def disc_points(center_xy_m: Floats, radius_m: float, height_m: float) -> Floats:
    """Quadrature points (7, 3) of a disc at height z, weighted by :data:`DISC_WEIGHTS`."""
    xy = np.asarray(center_xy_m) + radius_m * DISC_POINTS
    return np.column_stack([xy, np.full(len(xy), height_m)])


@dataclass(frozen=True)
class Springs:
    """``points`` (p, nodes) interpolates the held points; ``stiffness_n_per_m`` (p,)."""

    points: sparse.csr_array
    stiffness_n_per_m: Floats

    def forces(self, positions_m: Floats, targets_m: Floats) -> Floats:
        """Force (p, 3) of each spring on the tissue, at nodes (n, 3) and targets (p, 3)."""
        stretch = targets_m - self.points @ positions_m
        return self.stiffness_n_per_m[:, None] * stretch

    def energy_and_gradient(self, positions_m: Floats, targets_m: Floats) -> tuple[float, Floats]:
        """Energy [J] and its gradient (nodes, 3)."""
        stretch = targets_m - self.points @ positions_m
        force = self.stiffness_n_per_m[:, None] * stretch
        return 0.5 * float(np.sum(force * stretch)), -(self.points.T @ force)

    def tangent(self) -> sparse.csc_array:
        """Second derivative (3 nodes, 3 nodes): constant."""
        scaled = self.points.multiply(self.stiffness_n_per_m[:, None])
        scalar = sparse.csc_array(self.points.T @ scaled)
        return sparse.csc_array(sparse.kron(scalar, np.eye(3), format="csc"))


def joined(parts: list[Springs]) -> Springs:
    """All springs as one set, in order."""
    return Springs(
        sparse.csr_array(sparse.vstack([part.points for part in parts], format="csr")),
        np.concatenate([part.stiffness_n_per_m for part in parts]),
    )
