from __future__ import annotations

import numpy as np
import pytest

from defras_bt.recording.rendering import Body, View, render
from defras_bt.recording.shapes import circle, disc, rectangle, vertex_normals
from defras_sim.camera.pinhole import looking_at
from tests.recording.synthetic_run import flap_surface

DOWN = View(looking_at(np.array([0.0, -1e-6, 0.5]), np.zeros(3)), 0.5, 60, 40)


def test_the_nearer_body_hides_the_farther() -> None:
    low = Body(*rectangle(0.03, 0.03, 0.0), (200, 0, 0))
    high = Body(*disc(np.array([0.0, 0.0, 0.05]), 0.01), (0, 200, 0))
    for bodies in ([low, high], [high, low]):
        picture = render(bodies, DOWN)
        assert picture.shape == (40, 60, 3)
        assert picture[20, 30].argmax() == 1
        assert picture[20, 36].argmax() == 0
    assert tuple(picture[1, 1]) == (255, 255, 255)


def test_a_body_casts_a_shadow() -> None:
    ground = Body(*rectangle(0.1, 0.1, 0.0), (200, 200, 200))
    lid = Body(*disc(np.array([-0.03, -0.04, 0.08]), 0.02), (0, 0, 200))
    alone, shaded = render([ground], DOWN), render([ground, lid], DOWN)
    darker = (shaded[..., 0].astype(int) < alone[..., 0]) & (shaded[..., 0] > 10)
    assert darker.any()


def test_normals_of_a_closed_surface_point_outwards() -> None:
    surface = flap_surface(0.0, 0.0, 9)
    normals = vertex_normals(surface.vertices_m, surface.triangles)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert np.all(normals[surface.upper, 2] > 0)
    assert np.all(normals[~surface.upper, 2] < 0)


def test_outlines_keep_their_radius() -> None:
    center_m = np.array([0.01, 0.02, -0.006])
    ring = circle(center_m, 0.015)
    assert np.linalg.norm(ring - center_m, axis=1) == pytest.approx(0.015)
    np.testing.assert_allclose(ring[0], ring[-1], atol=1e-12)
    vertices_m, triangles = disc(center_m, 0.015, 256)
    a, b, c = (vertices_m[triangles[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)[:, 2].sum() / 2
    assert area == pytest.approx(np.pi * 0.015**2, rel=1e-3)
