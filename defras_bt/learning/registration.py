"""The rival of every change of attachments: the camera does not stand where it is believed to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_bt.learning.misfit import misfit
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera
from defras_sim.surface import Surface

_ROBUST_M = 0.004
_ITERATIONS = 6


def fitted_registration(
    points_m: Sequence[Floats], surfaces: Sequence[Surface], camera: Camera
) -> Pose | None:
    """The rigid motion that brings the points (n, 3) of each frame closest to its surface.

    One motion for all frames. Iterated point-to-plane alignment (Chen and Medioni 1991) with
    Huber's weights; None where the camera sees nothing of a surface.
    """
    found = Pose(np.zeros(3))
    for _ in range(_ITERATIONS):
        rows, sides = [], []
        for points, surface in zip(points_m, surfaces, strict=True):
            moved = found.apply(points)
            compared = misfit(moved, surface, camera)
            if compared is None:
                return None
            lever = np.cross(moved, compared.direction)
            size = np.maximum(np.abs(compared.residual_m), 1e-12)
            weight = np.sqrt(np.minimum(1.0, _ROBUST_M / size))
            rows.append(weight[:, None] * np.hstack([compared.direction, lever]))
            sides.append(-weight * compared.residual_m)
        step = np.linalg.lstsq(np.concatenate(rows), np.concatenate(sides), rcond=None)[0]
        found = Pose(step[:3]) @ Pose(np.zeros(3)).moved(np.zeros(3), step[3:]) @ found
        if float(np.abs(step).max()) < 1e-5:
            break
    return found
