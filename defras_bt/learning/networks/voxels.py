"""What the voxel network is told: the tissue before the operation and the surface seen now.

A box of voxels over the tissue at rest and the space that it may be lifted into. Each voxel says
how near its centre is to the upper and the lower face at rest, and to the nearest point seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from defras_sim.geometry import Floats
from defras_sim.scene import Scene

VOXELS = (24, 24, 12)
"""Along x, y, z."""

CHANNELS = ("upper_face", "lower_face", "seen")
_NEAR_VOXELS = 1.5
_BELOW = 1.5
"""Voxels of the box that lie below the tissue's lower face."""


@dataclass(frozen=True)
class VoxelBox:
    """``low_m`` (3,) is the centre of the first voxel; voxels are cubes of ``size_m``."""

    low_m: Floats
    size_m: float

    @staticmethod
    def around(scene: Scene) -> VoxelBox:
        """Centred over the tissue, with room for one voxel beside it."""
        tissue = scene.tissue
        size_m = max(tissue.length_x_m, tissue.width_y_m) / (VOXELS[0] - 2)
        half_m = (np.array(VOXELS[:2]) - 1) / 2 * size_m
        bottom_m = float(tissue.shape.low_m[2]) - _BELOW * size_m
        return VoxelBox(np.array([-half_m[0], -half_m[1], bottom_m]), size_m)

    @property
    def centres_m(self) -> Floats:
        """Centres (x, y, z, 3) of all voxels."""
        steps = np.stack(np.meshgrid(*map(np.arange, VOXELS), indexing="ij"), axis=-1)
        return np.asarray(self.low_m + self.size_m * steps)

    def coordinates(self, places_m: Floats) -> Floats:
        """Places (n, 3) in voxels, from the centre of the first."""
        return np.asarray((places_m - self.low_m) / self.size_m)


def voxel_inputs(scene: Scene, cloud_m: Floats) -> Floats:
    """Channels (3, x, y, z) for the tissue of ``scene`` and the points (n, 3) seen of it."""
    box = VoxelBox.around(scene)
    centres = box.centres_m
    near_m = _NEAR_VOXELS * box.size_m
    shape = scene.tissue.shape
    columns = centres[:, :, 0, :2].reshape(-1, 2)
    covered = shape.covers(columns).reshape(VOXELS[:2])[:, :, None]
    faces = []
    for face in (shape.upper, shape.lower):
        height = face.at(columns)[:, 2].reshape(VOXELS[:2])[:, :, None]
        faces.append(covered * np.exp(-np.abs(centres[..., 2] - height) / near_m))
    away = cKDTree(cloud_m).query(centres, distance_upper_bound=5 * near_m)[0]
    return np.stack([*faces, np.exp(-away / near_m)])


def corners_of_holes(scene: Scene) -> tuple[NDArray[np.int64], Floats]:
    """The eight voxels (holes, 8) around each hole, numbered as in the flattened volume, and their
    trilinear weights."""
    last = np.array(VOXELS) - 1
    at = np.clip(VoxelBox.around(scene).coordinates(scene.holes_m), 0, last - 1e-6)
    low = np.floor(at).astype(np.int64)
    share = at - low
    places, weights = [], []
    for step in np.ndindex(2, 2, 2):
        x, y, z = (low + np.array(step)).T
        places.append((x * VOXELS[1] + y) * VOXELS[2] + z)
        weights.append(np.where(np.array(step) == 1, share, 1 - share).prod(axis=1))
    return np.stack(places, axis=1), np.stack(weights, axis=1)
