"""What lies under the tissue, as pictures show it: the bed and the region of interest on it."""

from __future__ import annotations

import numpy as np

from defras_bt.recording.shapes import Triangles, circle, disc, rectangle
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

# The bed is drawn this far below the region.
_BELOW_REGION_M = 0.0015
_BED_SQUARES = 48
_RINGS = 6


def bed_surface(scene: Scene, half_x_m: float, half_y_m: float) -> tuple[Floats, Triangles]:
    """The bed over a rectangle about the z axis: level under a slab, else as the tissue lies."""
    if scene.tissue.anatomy is None:
        return rectangle(half_x_m, half_y_m, float(scene.roi_center_m[2]) - _BELOW_REGION_M)
    count = _BED_SQUARES + 1
    x, y = (np.linspace(-half, half, count) for half in (half_x_m, half_y_m))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    height = scene.under_tissue_m(places)[:, 2:] - _BELOW_REGION_M
    i, j = np.meshgrid(np.arange(count - 1), np.arange(count - 1))
    first = (j * count + i).ravel()
    squares = np.stack([first, first + 1, first + count + 1, first + count], axis=1)
    return np.hstack([places, height]), squares[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def region_surface(scene: Scene, segments: int = 48) -> tuple[Floats, Triangles]:
    """The region of interest, facing up."""
    center_m, radius_m = scene.roi_center_m, scene.roi.radius_m
    if scene.tissue.anatomy is None:
        return disc(center_m, radius_m, segments)
    rings = [circle(center_m, radius_m * k / _RINGS, segments)[:-1] for k in range(1, _RINGS + 1)]
    points = scene.under_tissue_m(np.concatenate([center_m[None], *rings])[:, :2])
    here = np.arange(segments)
    ahead = (here + 1) % segments
    triangles = [np.stack([np.zeros_like(here), 1 + here, 1 + ahead], axis=1)]
    for inner in range(1, 1 + (_RINGS - 1) * segments, segments):
        a, b, c, d = inner + here, inner + ahead, inner + segments + here, inner + segments + ahead
        triangles += [np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)]
    return points, np.concatenate(triangles)


def region_outline_m(scene: Scene, segments: int = 48) -> Floats:
    """Closed outline (segments + 1, 3) of the region."""
    return scene.under_tissue_m(circle(scene.roi_center_m, scene.roi.radius_m, segments)[:, :2])
