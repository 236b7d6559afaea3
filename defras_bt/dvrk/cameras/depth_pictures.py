"""Depth and colour pictures that belong together, and the cloud they make."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.dvrk.cameras.point_cloud import ColouredCloud
from defras_bt.dvrk.cameras.unusable import Unusable
from defras_sim.geometry import Floats

SAME_MOMENT_S = 0.02
"""Stamps of pictures taken together differ by no more."""


def cloud_of(depth_m: Floats, rgb: NDArray[np.uint8], intrinsics: Floats) -> ColouredCloud:
    """The cloud in the camera's frame for a depth picture (h, w) and colours (h, w, 3).

    ``intrinsics`` (3, 3) are those of the depth picture, onto which the colours are aligned.

    Raises:
        Unusable: the pictures are of different sizes.
    """
    if rgb.shape[:2] != depth_m.shape:
        raise Unusable(
            f"the depth picture has {depth_m.shape} pixels and the colour picture "
            f"{rgb.shape[:2]}; give the topic of colours aligned to depth"
        )
    rows, columns = np.indices(depth_m.shape)
    x = (columns - intrinsics[0, 2]) / intrinsics[0, 0]
    y = (rows - intrinsics[1, 2]) / intrinsics[1, 1]
    return ColouredCloud(np.stack([x * depth_m, y * depth_m, depth_m], axis=-1), rgb)
