"""CameraLayer: what a depth camera reports of true points, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from defras_sim.camera.pinhole import tissue_from_camera
from defras_sim.effects.camera_effect import CameraEffect
from defras_sim.effects.effect import Values
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera
from defras_sim.worlds.protocol import CameraImage


class CameraLayer:
    """Depths change first, where the camera sits; then everything is displaced at once."""

    def __init__(self, camera: Camera, effects: Sequence[tuple[CameraEffect, Values]]) -> None:
        self._effects = tuple(effects)
        if not self._effects:
            return
        self._tissue_from_camera = tissue_from_camera(camera)
        placed = Pose(np.zeros(3))
        for effect, values in self._effects:
            placed = effect.placement(values, camera) @ placed
        self._reported_from_true = placed

    @property
    def is_plain(self) -> bool:
        """Whether the camera reports what is there."""
        return not self._effects

    def reported(self, points_m: Floats) -> Floats:
        """What the camera reports (n, 3) for true points (n, 3), both in the tissue frame."""
        if self.is_plain:
            return points_m
        return self._reported_from_true.apply(self._at_depths(points_m, self._depth_m))

    def corrected(self, points_m: Floats) -> Floats:
        """The true points (n, 3) for those that the camera reports (n, 3)."""
        if self.is_plain:
            return points_m
        return self._at_depths(self._reported_from_true.inverse().apply(points_m), self._true_m)

    def reported_image(self, image: CameraImage) -> CameraImage:
        """What the camera reports for a true picture with depth."""
        if self.is_plain or image.depth_m is None:
            return image
        return replace(
            image,
            depth_m=self._depth_m(image.depth_m),
            tissue_from_camera=self._reported_from_true @ image.tissue_from_camera,
        )

    def _at_depths(self, points_m: Floats, changed: Callable[[Floats], Floats]) -> Floats:
        """Points (n, 3) moved along their rays to the depths that ``changed`` makes of theirs."""
        seen = self._tissue_from_camera.inverse().apply(points_m)
        return self._tissue_from_camera.apply(seen * (changed(seen[:, 2]) / seen[:, 2])[:, None])

    def _depth_m(self, true_m: Floats) -> Floats:
        for effect, values in self._effects:
            true_m = effect.depth_m(values, true_m)
        return true_m

    def _true_m(self, depth_m: Floats) -> Floats:
        for effect, values in reversed(self._effects):
            depth_m = effect.true_depth_m(values, depth_m)
        return depth_m
