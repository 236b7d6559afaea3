"""The tissue out of a camera's cloud: by colour, by place, decimated, in the tissue frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_bt.dvrk.cameras.point_cloud import ColouredCloud
from defras_bt.dvrk.cameras.unusable import require_metres
from defras_bt.sensing.cloud import VOXEL_M, Workspace, decimate_m, tissue_pixels
from defras_bt.sensing.colours import ColourCalibration
from defras_sim.geometry import Floats, Pose


@dataclass(frozen=True)
class TissueFilter:
    """What of a depth camera's cloud is tissue. ``tissue_from_camera`` is the registered one."""

    tissue_from_camera: Pose
    workspace: Workspace
    colours: ColourCalibration
    voxel_m: float = VOXEL_M

    def points_m(self, cloud: ColouredCloud) -> Floats:
        """Points (n, 3) of the tissue in the tissue frame, one per voxel.

        Raises:
            Unusable: the cloud is not in metres, or empty.
        """
        require_metres(np.linalg.norm(cloud.points, axis=-1).ravel(), "cloud")
        points_m = self.tissue_from_camera.apply(cloud.points[taken_points(cloud, self.colours)])
        return decimate_m(points_m[self.workspace.holds(points_m)], self.voxel_m)


def taken_points(cloud: ColouredCloud, colours: ColourCalibration) -> NDArray[np.bool_]:
    """Which points (h, w) have the tissue's colour; all that were measured without colours.

    In a cloud with the rows of a picture, points at edges are left out: they mix two depths.
    """
    depth_m = cloud.points[..., 2]
    measured: NDArray[np.bool_] = np.isfinite(depth_m)
    if cloud.rgb is None:
        return measured
    if cloud.is_picture:
        return tissue_pixels(cloud.rgb, depth_m, colours)
    return measured & colours.tissue.mask(cloud.rgb)
