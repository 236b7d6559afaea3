"""How much of the region of interest the endoscope sees."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from defras_sim.camera.pinhole import in_picture
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

ROI_SAMPLES = 256


@lru_cache(maxsize=4)
def unit_disc(samples: int) -> Floats:
    """Evenly spread points (samples, 2) on the unit disc, always the same (Vogel's spiral)."""
    index = np.arange(samples) + 0.5
    radius = np.sqrt(index / samples)
    angle = index * np.pi * (3.0 - np.sqrt(5.0))
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    points.setflags(write=False)
    return points


def roi_points_m(scene: Scene, samples: int = ROI_SAMPLES) -> Floats:
    """Points (samples, 3) spread evenly over the region of interest."""
    return scene.under_tissue_m(scene.roi_center_m[:2] + scene.roi.radius_m * unit_disc(samples))


def roi_visibility(scene: Scene, tissue: RayCaster) -> float:
    """Share (0..1) of the region that is in the endoscope's picture and not behind tissue."""
    points = roi_points_m(scene)
    seen = in_picture(scene.endoscope, points)
    seen &= tissue.sees(np.array(scene.endoscope.position_m), points)
    return float(np.mean(seen))
