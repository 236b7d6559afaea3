"""Slabs of any shape and the clouds a camera would take of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.surface import Surface

Deform = Callable[[Floats], Floats]


def _slab(deform: Deform = lambda points: points, cells: int = 16) -> Surface:
    """A closed 120 x 120 x 5 mm slab whose vertices (n, 3) went through ``deform``."""
    steps = np.linspace(-0.06, 0.06, cells + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps))
    size = len(x)
    vertices = np.concatenate([np.column_stack([x, y, np.full(size, z)]) for z in (0.0, -0.005)])
    index = np.arange(size).reshape(cells + 1, cells + 1)
    corners = [index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]]
    a, b, c, d = (corner.ravel() for corner in corners)
    top = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    bottom = top[:, ::-1] + size
    rim = np.concatenate([index[0], index[1:, -1], index[-1, -2::-1], index[-2:0:-1, 0]])
    after = np.roll(rim, -1)
    side = np.concatenate(
        [
            np.column_stack([rim, rim + size, after]),
            np.column_stack([after, rim + size, after + size]),
        ]
    )
    upper = np.arange(2 * size) < size
    triangles = np.concatenate([top, bottom, side])
    return Surface(deform(vertices), triangles, upper, np.tile(np.column_stack([x, y]), (2, 1)))


@pytest.fixture(scope="session")
def slab() -> Callable[..., Surface]:
    return _slab


@pytest.fixture(scope="session")
def scene() -> Scene:
    return Scene(
        name="slab",
        attachments=Attachments(map=("#" * 12,) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
    )


@pytest.fixture(scope="session")
def take_cloud(scene: Scene) -> Callable[[Surface, int], Floats]:
    """The depth camera's cloud of a surface, with 0.5 mm noise, for a seed."""

    def take(surface: Surface, seed: int) -> Floats:
        rng = np.random.default_rng(seed)
        return depth_cloud_m(scene.depth_camera, surface, RayCaster(surface), rng)

    return take


def _bump(height_m: float, width_m: float = 0.012) -> Deform:
    """Lift a round patch near (20, 10) mm by ``height_m``."""

    def deform(points: Floats) -> Floats:
        square = np.sum((points[:, :2] - [0.02, 0.01]) ** 2, axis=1)
        lift = height_m * np.exp(-square / (2 * width_m**2))
        return points + np.column_stack([np.zeros((len(points), 2)), lift])

    return deform


@pytest.fixture(scope="session")
def bump() -> Callable[..., Deform]:
    return _bump
