"""Rigid poses. A name like ``tissue_from_tip`` maps tip coordinates to tissue coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


def _identity() -> Floats:
    return np.eye(3)


@dataclass(frozen=True)
class Pose:
    """A rigid transform: ``position_m`` (3,) and ``rotation`` (3, 3), both in the parent frame."""

    position_m: Floats
    rotation: Floats = field(default_factory=_identity)

    def apply(self, points_m: Floats) -> Floats:
        """Map points (..., 3) from the child frame to the parent frame."""
        return np.asarray(points_m) @ self.rotation.T + self.position_m

    def inverse(self) -> Pose:
        return Pose(-self.rotation.T @ self.position_m, self.rotation.T)

    def __matmul__(self, child: Pose) -> Pose:
        return Pose(self.apply(child.position_m), self.rotation @ child.rotation)

    def moved(self, linear_m: Floats, angular_rad: Floats | None = None) -> Pose:
        """Translate, and rotate about the pose's own origin, both expressed in the parent frame."""
        rotation = self.rotation
        if angular_rad is not None and angular_rad.any():
            rotation = Rotation.from_rotvec(angular_rad).as_matrix() @ rotation
        return Pose(self.position_m + linear_m, rotation)

    @property
    def quaternion_xyzw(self) -> Floats:
        return Rotation.from_matrix(self.rotation).as_quat()
