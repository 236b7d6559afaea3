"""Rays against planes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_sim.camera.ray_caster import RayCaster
from defras_sim.surface import Surface

PlaneMaker = Callable[..., Surface]


def test_a_ray_meets_a_plane_where_geometry_says(plane: PlaneMaker) -> None:
    caster = RayCaster(plane(0.01))
    origin = np.array([0.0, 0.0, 0.11])
    found = caster.hits(origin, np.array([[0.0, 0, -1], [0.3, 0, -1], [1, 0, -1], [0, 0, 1]]))
    assert np.allclose(found[:2], 0.1, atol=1e-6)
    assert np.isinf(found[2:]).all()


def test_seeing_stops_at_the_surface_and_counts_the_surface_itself(plane: PlaneMaker) -> None:
    caster = RayCaster(plane())
    points = np.array([[0.01, 0.0, 0.001], [0.01, 0.0, 0.0], [0.01, 0.0, -0.001]])
    assert caster.sees(np.array([0.0, 0.0, 0.2]), points).tolist() == [True, True, False]
