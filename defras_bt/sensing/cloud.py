"""From a depth picture to the cloud of the tissue."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from defras_bt.sensing.colours import ColourCalibration
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import CameraImage

# One point per cube of this edge leaves about 1,000 points of a 120 x 120 mm tissue.
VOXEL_M = 0.004
# Pixels next to anything that is not tissue mix two depths ("flying pixels"): left out.
MARGIN_PX = 2
# Depth that changes by more than this between neighbours is an edge, not a slope.
DEPTH_JUMP_M = 0.008


@dataclass(frozen=True)
class Workspace:
    """The box (3,), (3,) in the tissue frame outside of which nothing can be tissue."""

    low_m: Floats
    high_m: Floats

    @staticmethod
    def of(scene: Scene) -> Workspace:
        """Everywhere the scene's manoeuvres can take the tissue, with 20 mm to spare."""
        low, high = scene.tissue.shape.low_m, scene.tissue.shape.high_m
        reach = max(scene.motion.fold_distance_m, scene.motion.move_limit_m) + 0.02
        above = scene.motion.pull_height_m + 0.04
        return Workspace(low - [reach, reach, 0.02], high + [reach, reach, above])

    def holds(self, points_m: Floats) -> NDArray[np.bool_]:
        """Which points (n, 3) lie inside; NaN is outside."""
        inside: NDArray[np.bool_] = np.all(
            (points_m >= self.low_m) & (points_m <= self.high_m), axis=1
        )
        return inside


def tissue_points_m(image: CameraImage, scene: Scene, colours: ColourCalibration) -> Floats:
    """Points (n, 3) of the tissue in the tissue frame, one per voxel.

    Raises:
        ValueError: the picture carries no depth.
    """
    if image.depth_m is None:
        raise ValueError("the depth camera's picture has no depth_m; it needs one per pixel")
    pixels = tissue_pixels(image.rgb, image.depth_m, colours)
    points = back_project_m(image, pixels)
    points = points[Workspace.of(scene).holds(points)]
    return decimate_m(points, VOXEL_M)


def tissue_pixels(
    rgb: NDArray[np.uint8], depth_m: Floats, colours: ColourCalibration
) -> NDArray[np.bool_]:
    """Pixels (h, w) that surely are tissue: by colour, with depth, and away from every edge."""
    measured = np.isfinite(depth_m) & (depth_m > 0.0)
    tissue = colours.tissue.mask(rgb) & measured
    tissue = ndimage.binary_erosion(
        tissue, np.ones((3, 3), bool), iterations=MARGIN_PX, border_value=1
    )
    nearest = ndimage.minimum_filter(np.where(measured, depth_m, np.inf), size=3)
    farthest = ndimage.maximum_filter(np.where(measured, depth_m, -np.inf), size=3)
    smooth: NDArray[np.bool_] = tissue & (farthest - nearest < DEPTH_JUMP_M)
    return smooth


def back_project_m(image: CameraImage, pixels: NDArray[np.bool_]) -> Floats:
    """Tissue-frame points (n, 3) of the marked pixels; (0, 0) is the first pixel's centre."""
    assert image.depth_m is not None
    rows, columns = np.nonzero(pixels)
    homogeneous = np.column_stack([columns, rows, np.ones(len(rows))]).astype(float)
    rays = homogeneous @ np.linalg.inv(image.intrinsics).T
    return image.tissue_from_camera.apply(rays * image.depth_m[pixels][:, None])


def decimate_m(points_m: Floats, voxel_m: float) -> Floats:
    """The mean point of every occupied cube of edge ``voxel_m``, in a fixed order.

    Cubes are centred on the origin, so that the resting face z = 0 falls into one layer of them.
    """
    if len(points_m) == 0:
        return points_m.reshape(0, 3)
    cubes = np.round(points_m / voxel_m).astype(np.int64)
    cubes -= cubes.min(axis=0)
    extent = cubes.max(axis=0) + 1
    key = np.ravel_multi_index(tuple(cubes.T), tuple(extent))
    _, member, count = np.unique(key, return_inverse=True, return_counts=True)
    sums = [np.bincount(member, weights=points_m[:, axis]) for axis in range(3)]
    return np.stack(sums, axis=1) / count[:, None]
