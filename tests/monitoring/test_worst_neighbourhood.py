"""The worst median of distances to a surface, against a k-d tree and trimesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from defras_bt.monitoring.worst_neighbourhood import worst_median_m
from defras_sim.geometry import Floats
from defras_sim.surface import Surface
from tests.monitoring.point_clouds import clouds
from tests.monitoring.shapes import wavy

RADIUS_M = 0.0075


def medians_m(points_m: Floats, distances_m: Floats) -> list[float]:
    """Medians over the nearest 24 neighbours in reach, of all points with at least 5."""
    tree, medians = cKDTree(points_m), []
    for point in points_m:
        near_m, index = tree.query(point, min(24, len(points_m)), distance_upper_bound=RADIUS_M)
        index = np.atleast_1d(index)[np.isfinite(np.atleast_1d(near_m))]
        if len(index) >= 5:
            medians.append(float(np.median(distances_m[index])))
    return medians


@pytest.mark.parametrize("seed", range(3, 7))
@pytest.mark.parametrize("shape", clouds(0))
def test_it_is_that_of_the_nearest_neighbours_in_reach(
    slab: Callable[..., Surface], shape: str, seed: int
) -> None:
    points, surface = clouds(seed)[shape], slab(wavy(seed))
    mesh = trimesh.Trimesh(surface.vertices_m, surface.triangles, process=False)
    _, distances, _ = trimesh.proximity.closest_point(mesh, points)
    expected = medians_m(points, distances)
    corners = surface.vertices_m[surface.triangles]
    worst, known = worst_median_m(points, corners, RADIUS_M, 5, 24)
    assert known == len(expected)
    if expected:
        assert worst == pytest.approx(max(expected), abs=1e-12)
    else:
        assert np.isnan(worst)


@pytest.mark.parametrize("seed", range(4))
def test_a_dent_is_found_however_small_the_noise_around_it(
    slab: Callable[..., Surface], seed: int
) -> None:
    rng, surface = np.random.default_rng(seed), slab()
    points = rng.uniform(-0.055, 0.055, (1500, 3)) * [1, 1, 0]
    points[:, 2] = surface.vertices_m[:, 2].max() + rng.normal(0.0, 1e-3, len(points))
    beside = np.linalg.norm(points[:, :2] - rng.uniform(-0.04, 0.04, 2), axis=1)
    points[beside < 0.01, 2] += 0.006
    mesh = trimesh.Trimesh(surface.vertices_m, surface.triangles, process=False)
    _, distances, _ = trimesh.proximity.closest_point(mesh, points)
    corners = surface.vertices_m[surface.triangles]
    worst, _ = worst_median_m(points, corners, RADIUS_M, 5, 24)
    assert worst == pytest.approx(max(medians_m(points, distances)), abs=1e-12)
    assert 0.004 < worst < 0.009
