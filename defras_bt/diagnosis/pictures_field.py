"""The tissue at the moment at which the plain simulation is farthest off, drawn in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from defras_bt.diagnosis.exhibits import ReplayFrame
from defras_bt.recording import palette
from defras_bt.recording.ground import bed_surface, region_surface
from defras_bt.recording.rendering import Body, render
from defras_bt.recording.scene_picture import field_view
from defras_bt.recording.shapes import disc
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface

_BED: palette.Rgb = (205, 216, 222)
_POINT_M = 0.0007
_MOST_POINTS = 1500
_NEAR_M = 0.010
_AVERAGED = 5
_SHADES = 12
_UNSEEN: palette.Rgb = (196, 200, 205)


def worst_frame(replay: tuple[ReplayFrame, ...]) -> ReplayFrame | None:
    """The frame with the largest 95th percentile of distances to the plain surface."""
    seen = [frame for frame in replay if len(frame.before_m) and len(frame.after_m)]
    return max(seen, key=lambda f: percentile_m(f.before_m), default=None)


def percentile_m(distance_m: Floats) -> float:
    """95th percentile of the sizes of distances (n,)."""
    return float(np.percentile(np.abs(distance_m), 95))


def field_picture(frame: ReplayFrame, scene: Scene, *, extended: bool) -> NDArray[np.uint8]:
    """Simulated surface, coloured by how far what was seen is from it, with the points seen."""
    surface = frame.extended if extended else frame.plain
    cloud_m = frame.extended_cloud_m if extended else frame.plain_cloud_m
    distance_m = frame.after_m if extended else frame.before_m
    bodies = [
        Body(*bed_surface(scene, 0.16, 0.14), _BED),
        Body(*region_surface(scene), palette.ROI),
        *(
            Body(*disc(place_m, 0.0032, 16), palette.BELIEVED)
            for place_m in scene.holes_m[scene.attached] - [0.0, 0.0, 0.0006]
        ),
        *_shaded(surface, cloud_m, distance_m, scene.thresholds.delta_m),
        _points(cloud_m),
    ]
    return render(bodies, field_view())


def _shaded(
    surface: Surface, cloud_m: Floats, distance_m: Floats, delta_m: tuple[float, ...]
) -> list[Body]:
    """The surface as one body per shade of colour; grey where nothing was seen near it."""
    tree = cKDTree(cloud_m)
    centres_m = surface.vertices_m[surface.triangles].mean(axis=1)
    count = min(_AVERAGED, len(cloud_m))
    gap_m, at = tree.query(centres_m, k=np.arange(1, count + 1), distance_upper_bound=_NEAR_M)
    found = np.isfinite(gap_m)
    sizes = np.append(np.abs(distance_m), 0.0)[at]
    mean_m = (sizes * found).sum(axis=1) / np.maximum(found.sum(axis=1), 1)
    top_m = delta_m[-1]
    shade = np.minimum((mean_m / top_m * _SHADES).astype(int), _SHADES - 1)
    shade[~found.any(axis=1)] = -1
    bodies = []
    for each in np.unique(shade):
        middle_m = np.array([(each + 0.5) / _SHADES * top_m])
        drawn = palette.discrepancy_colours(middle_m, delta_m)[0]
        colour = _UNSEEN if each < 0 else (int(drawn[0]), int(drawn[1]), int(drawn[2]))
        bodies.append(Body(surface.vertices_m, surface.triangles[shade == each], colour))
    return bodies


def _points(cloud_m: Floats) -> Body:
    """What the camera saw, as small octahedra."""
    shown = cloud_m[:: max(1, -(-len(cloud_m) // _MOST_POINTS))]
    corners = _POINT_M * np.array(
        [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float
    )
    faces = np.array(
        [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    )
    vertices = (shown[:, None] + corners).reshape(-1, 3)
    triangles = (6 * np.arange(len(shown))[:, None, None] + faces).reshape(-1, 3)
    return Body(vertices, triangles, palette.INK)
