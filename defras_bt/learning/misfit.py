"""How far observed points lie off a simulated shape, and how that changes with the holes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.closest import closest_on_triangles
from defras_bt.monitoring.seen import seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Camera
from defras_sim.surface import Surface

# Below this distance the direction to the closest point is noise; the face's normal is better.
_TOUCHING_M = 2e-4


@dataclass(frozen=True)
class Misfit:
    """Points (n) against one visible surface.

    ``residual_m`` (n,) is signed, positive outside of the tissue. ``direction`` (n, 3) is the unit
    vector along which it is measured. The closest place is the mean of the surface vertices
    ``vertices`` (n, 3) weighted by ``weights`` (n, 3).
    """

    residual_m: Floats
    direction: Floats
    vertices: NDArray[np.int64]
    weights: Floats

    @property
    def mean_m(self) -> float:
        """Mean distance of all points."""
        return float(np.abs(self.residual_m).mean())

    def jacobian(self, sensitivity: Floats) -> Floats:
        """Derivative (n, parameters) of the residuals; ``sensitivity`` (vertices, 3, parameters).

        To first order a closest point that slides along the surface changes no distance.
        """
        towards = self.direction[:, None, :] * self.weights[:, :, None]
        rows, shape = len(self.residual_m), sensitivity.shape
        jacobian = np.zeros((rows, shape[2]))
        for corner in range(3):
            moved = sensitivity[self.vertices[:, corner]]
            jacobian -= np.einsum("nd,ndp->np", towards[:, corner], moved, optimize=True)
        return jacobian


def misfit(points_m: Floats, surface: Surface, camera: Camera) -> Misfit | None:
    """Compare points (n, 3) with what ``camera`` sees of ``surface``; None if it sees nothing."""
    seen = seen_surface(surface, camera)
    if len(seen.triangles) == 0:
        return None
    closest = closest_on_triangles(points_m, seen.corners_m)
    corners = seen.corners_m[closest.triangle]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-15)
    gap = points_m - np.einsum("nk,nkd->nd", closest.weights, corners)
    side = np.where(np.einsum("nd,nd->n", gap, normal) < 0.0, -1.0, 1.0)
    distance = closest.distance_m
    away = distance > _TOUCHING_M
    direction = normal.copy()
    direction[away] = side[away, None] * gap[away] / distance[away, None]
    vertices = surface.triangles[seen.triangles[closest.triangle]]
    return Misfit(side * distance, direction, vertices, closest.weights)
