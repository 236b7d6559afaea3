"""The closest point on triangles, against trimesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import trimesh

from defras_bt.monitoring.closest import closest_on_triangles
from defras_sim.surface import Surface


def test_distances_equal_those_of_trimesh(
    slab: Callable[..., Surface], bump: Callable[..., object]
) -> None:
    surface = slab(bump(0.03))
    points = np.random.default_rng(1).uniform(-0.08, 0.08, (400, 3))
    found = closest_on_triangles(points, surface.vertices_m[surface.triangles])
    mesh = trimesh.Trimesh(surface.vertices_m, surface.triangles, process=False)
    _, expected, _ = trimesh.proximity.closest_point_naive(mesh, points)
    np.testing.assert_allclose(found.distance_m, expected, atol=1e-12)


def test_the_weights_say_where_the_closest_point_is(slab: Callable[..., Surface]) -> None:
    corners = slab().vertices_m[slab().triangles]
    points = np.random.default_rng(2).uniform(-0.08, 0.08, (300, 3))
    found = closest_on_triangles(points, corners)
    place = np.einsum("nk,nkd->nd", found.weights, corners[found.triangle])
    np.testing.assert_allclose(np.linalg.norm(points - place, axis=1), found.distance_m, atol=1e-12)
    assert found.weights.min() >= 0.0
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((0.2, 0.2, 0.5), 0.5),
        ((-1.0, -1.0, 0.0), np.sqrt(2)),
        ((0.5, -2.0, 0.0), 2.0),
        ((1.0, 1.0, 0.0), np.sqrt(0.5)),
        ((0.0, 3.0, 0.0), 2.0),
    ],
)
def test_face_corner_and_edges_of_one_triangle(point: tuple[float, ...], distance: float) -> None:
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    found = closest_on_triangles(np.array([point]), corners)
    assert found.distance_m[0] == pytest.approx(distance)


def test_a_degenerate_triangle_is_its_longest_edge() -> None:
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]])
    found = closest_on_triangles(np.array([[1.5, 1.0, 0.0], [3.0, 0.0, 0.0]]), corners)
    np.testing.assert_allclose(found.distance_m, [1.0, 1.0])


def test_bad_input_is_refused() -> None:
    with pytest.raises(ValueError, match="no triangles"):
        closest_on_triangles(np.zeros((1, 3)), np.zeros((0, 3, 3)))
    with pytest.raises(ValueError, match="finite"):
        closest_on_triangles(np.full((1, 3), np.nan), np.zeros((1, 3, 3)))


@pytest.mark.parametrize("off_m", [0.0, 0.01, 0.5])
@pytest.mark.parametrize("size_m", [0.002, 0.02])
def test_nothing_nearer_is_missed_among_random_triangles(off_m: float, size_m: float) -> None:
    rng = np.random.default_rng(7)
    middle = rng.uniform(-0.06, 0.06, (250, 1, 3)) * [1, 1, 0.2]
    corners = middle + size_m * rng.normal(size=(250, 3, 3))
    corners[::50] *= 5.0
    points = rng.uniform(-0.06, 0.06, (150, 3)) + off_m * rng.normal(size=(150, 3))
    found = closest_on_triangles(points, corners)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(750).reshape(-1, 3), process=False)
    _, expected, _ = trimesh.proximity.closest_point_naive(mesh, points)
    np.testing.assert_allclose(found.distance_m, expected, atol=1e-12)


def test_of_triangles_equally_near_the_first_counts() -> None:
    fan = np.array(
        [
            [[0.0, 0, 0], [np.cos(a), np.sin(a), 0], [np.cos(b), np.sin(b), 0]]
            for a, b in zip(np.arange(6.0), np.arange(1.0, 7.0), strict=True)
        ]
    )
    points = np.array([[5.0, 5.0, 0.0], [0.0, 0.0, 1.0], [-3.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    assert closest_on_triangles(points, fan).triangle[[1, 3]].tolist() == [0, 0]
