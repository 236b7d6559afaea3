"""CameraEffect: the depth camera does not report where the tissue is."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from defras_sim.effects.effect import Effect, Layer, TwinName, Values
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera


class CameraEffect(Effect):
    """Changes what the depth camera says of a true point: its depth, then its place.

    Depths are along the optical axis of the camera where the scene says that it stands.
    """

    layer: ClassVar[Layer] = "camera"
    twins: ClassVar[tuple[TwinName, ...]] = ("tissue",)

    def depth_m(self, values: Values, true_m: Floats) -> Floats:
        """Depths (...,) that the camera reports for true ones (...,)."""
        return true_m

    def true_depth_m(self, values: Values, depth_m: Floats) -> Floats:
        """The inverse of :meth:`depth_m`."""
        return depth_m

    def placement(self, values: Values, camera: Camera) -> Pose:
        """reported_from_true: how points (tissue frame) are displaced by where the camera is."""
        return Pose(np.zeros(3))
