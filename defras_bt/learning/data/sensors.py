"""What the depth camera delivers: noise with drift, and what an instrument hides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats
from defras_sim.scene import Camera
from defras_sim.surface import Surface

_DRIFT_M = 0.0003
_LOST_RADIUS_M = (0.005, 0.02)


@dataclass
class DepthSensor:
    """A camera with white noise, a slow drift along the rays, instruments in the way, and lost
    discs, as specular highlights leave them."""

    camera: Camera
    shaft_radius_m: float
    lost_discs: int
    rng: np.random.Generator
    drift_m: float = 0.0

    @staticmethod
    def drawn(camera: Camera, rng: np.random.Generator) -> DepthSensor:
        """Half of the cameras see past the instruments; a third lose discs."""
        radius_m = 0.0 if rng.random() < 0.5 else float(rng.uniform(0.003, 0.008))
        discs = 0 if rng.random() < 0.67 else int(rng.integers(1, 4))
        return DepthSensor(camera, radius_m, discs, rng)

    def cloud_m(self, surface: Surface, shafts_m: Floats) -> Floats:
        """Points (n, 3) seen past instruments ``shafts_m`` (arms, 2, 3), each from tip to RCM."""
        points = depth_cloud_m(self.camera, surface, RayCaster(surface), self.rng)
        if len(points) == 0:
            return points
        eye_m = np.array(self.camera.position_m)
        rays = points - eye_m
        self.drift_m = 0.8 * self.drift_m + 0.6 * _DRIFT_M * float(self.rng.standard_normal())
        shown = points + self.drift_m * rays / np.linalg.norm(rays, axis=1, keepdims=True)
        kept = np.ones(len(points), bool)
        if self.shaft_radius_m > 0:
            for tip_m, rcm_m in shafts_m:
                kept &= passing_m(eye_m, points, tip_m, rcm_m) > self.shaft_radius_m
        for _ in range(self.lost_discs):
            centre = points[self.rng.integers(len(points))]
            radius_m = self.rng.uniform(*_LOST_RADIUS_M)
            kept &= np.linalg.norm(points - centre, axis=1) > radius_m
        return np.asarray(shown[kept])


def passing_m(eye_m: Floats, points_m: Floats, start_m: Floats, end_m: Floats) -> Floats:
    """How near (n,) the sight from ``eye_m`` to each point comes to the segment between two places.

    Sampled along the segment, 2 mm apart.
    """
    count = max(2, int(np.linalg.norm(end_m - start_m) / 0.002))
    along = start_m + np.linspace(0.0, 1.0, count)[:, None] * (end_m - start_m)
    rays = points_m - eye_m
    length = np.linalg.norm(rays, axis=1)
    to_segment = along - eye_m
    share = np.clip(to_segment @ rays.T / length**2, 0.0, 1.0)  # (samples, n)
    squared = (
        (to_segment**2).sum(axis=1)[:, None]
        - 2 * share * (to_segment @ rays.T)
        + share**2 * length**2
    )
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)).min(axis=0))
