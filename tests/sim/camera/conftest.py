"""Plain geometry for the camera tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_sim.scene import Attachments, Camera, Roi, Scene
from defras_sim.surface import Surface

PlaneMaker = Callable[..., Surface]


@pytest.fixture
def camera() -> Camera:
    """Looks at the origin from the +x side, without noise."""
    return Camera(position_m=(0.17, 0.0, 0.20), target_m=(0.0, 0.0, 0.0), noise_sd_m=0.0)


@pytest.fixture
def plain_scene() -> Scene:
    """All holes hold; the region lies under the middle."""
    attachments = Attachments(map=("############",) * 12)
    return Scene(name="plain", attachments=attachments, roi=Roi(center_x_m=0.0, center_y_m=0.0))


@pytest.fixture
def plane() -> PlaneMaker:
    """Makes a horizontal rectangle out of triangles about 3 mm wide."""

    def make(
        z_m: float = 0.0,
        low_xy_m: tuple[float, float] = (-0.06, -0.06),
        high_xy_m: tuple[float, float] = (0.06, 0.06),
    ) -> Surface:
        x = np.linspace(low_xy_m[0], high_xy_m[0], 40)
        y = np.linspace(low_xy_m[1], high_xy_m[1], 40)
        flat = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        corner = np.arange(1600).reshape(40, 40)[:-1, :-1].ravel()[:, None]
        triangles = np.concatenate([corner + [0, 1, 41], corner + [0, 41, 40]])
        vertices = np.column_stack([flat, np.full(len(flat), z_m)])
        return Surface(vertices, triangles, np.ones(len(flat), bool), flat)

    return make
