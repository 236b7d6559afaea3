"""Where a tool went, as the depth camera has it: tells whether arm and camera agree on a frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import Scene

_BESIDE_M = 0.03
_ABOVE_M = 0.05
_BELOW_M = 0.012
_OVER_TISSUE_M = 0.008
_FEWEST = 30
"""Fewer points say less about a stroke of 2 mm than the stroke is long."""
_LOWEST = 0.05


class SeenTool:
    """Follows what stands up from the tissue near a tip, in whole clouds of all that is seen.

    Sideways it is the mean of the points in a slice that counts, and upwards the lowest of them:
    neighbours cannot be followed along a smooth shaft.
    """

    def __init__(self, scene: Scene, cloud_m: Callable[[], Floats | None]) -> None:
        """``cloud_m`` gives the newest cloud (n, 3) in the tissue frame, None before the first."""
        self._cloud_m = cloud_m
        self._floor_m = float(scene.tissue.shape.high_m[2]) + _OVER_TISSUE_M
        self._at_m = np.zeros(3)
        self._before: Floats | None = None

    def look(self, tip_m: Floats) -> None:
        self._at_m = np.array(tip_m)
        self._before = self._place_m()

    def moved_m(self, tip_m: Floats) -> Floats | None:
        now = self._place_m()
        if self._before is None or now is None:
            return None
        moved: Floats = now - self._before
        return moved

    def _place_m(self) -> Floats | None:
        """Mean x, mean y and lowest z of the tool near where the stroke began."""
        cloud_m = self._cloud_m()
        if cloud_m is None:
            return None
        near = np.linalg.norm(cloud_m[:, :2] - self._at_m[:2], axis=1) < _BESIDE_M
        height_m = cloud_m[:, 2] - self._at_m[2]
        tool = cloud_m[near & (cloud_m[:, 2] > self._floor_m) & (height_m < _ABOVE_M)]
        tool = tool[tool[:, 2] > self._at_m[2] - _BELOW_M]
        if len(tool) < _FEWEST:
            return None
        lowest_m = float(np.quantile(tool[:, 2], _LOWEST))
        # Always the same slice, whatever the stroke: a slanted shaft stands elsewhere higher up.
        middle = tool[tool[:, 2] > self._at_m[2] + _BELOW_M]
        if len(middle) < _FEWEST:
            return None
        return np.array([*middle[:, :2].mean(axis=0), lowest_m])
