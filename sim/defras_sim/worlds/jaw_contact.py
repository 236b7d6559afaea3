"""Whether a jaw has tissue between its ends."""

from __future__ import annotations

import numpy as np
from trimesh.triangles import closest_point

from defras_sim.geometry import Floats
from defras_sim.surface import Surface

# A jaw reaches this far around its tip.
GRASP_REACH_M = 0.004


def meets_tissue(surface: Surface, tip_m: Floats) -> bool:
    """Whether a jaw that closes with its tip at ``tip_m`` (3,) takes the tissue."""
    return distance_to_upper_m(surface, tip_m) < GRASP_REACH_M


def distance_to_upper_m(surface: Surface, point_m: Floats) -> float:
    """Distance from a point (3,) to the nearest triangle of the upper face."""
    corners = surface.triangles[surface.upper[surface.triangles].all(axis=1)]
    closest = closest_point(surface.vertices_m[corners], np.tile(point_m, (len(corners), 1)))
    return float(np.linalg.norm(closest - point_m, axis=1).min())
