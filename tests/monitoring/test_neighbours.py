"""Nearest points and medians over neighbourhoods, against k-d trees."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from defras_bt.monitoring.neighbours import nearest_m, worst_median
from defras_sim.geometry import Floats

RADIUS_M = 0.0075


def clouds(seed: int) -> dict[str, Floats]:
    """Points (n, 3) of shapes that sort into cubes in different ways."""
    rng = np.random.default_rng(seed)
    sheet = rng.uniform(-0.06, 0.06, (700, 3)) * [1, 1, 0]
    return {
        "sheet": sheet,
        "folded sheet": np.concatenate([sheet, sheet * [0.5, 1, 1] + [0, 0, 0.01]]),
        "ball": rng.normal(0, 0.03, (500, 3)),
        "line": rng.uniform(-0.06, 0.06, (60, 1)) * [1.0, 2.0, 0.5],
        "one point": rng.normal(size=(1, 3)),
        "the same point": np.tile(rng.normal(size=(1, 3)), (30, 1)),
        "sheet and one far away": np.concatenate([sheet, [[50.0, -3.0, 2.0]]]),
        "dense": rng.uniform(-0.02, 0.02, (900, 3)) * [1, 1, 0.1],
    }


@pytest.mark.parametrize("shape", clouds(0))
@pytest.mark.parametrize("asked", ["sheet", "ball", "sheet and one far away"])
def test_the_nearest_is_as_near_as_a_tree_says(shape: str, asked: str) -> None:
    others, points = clouds(1)[shape], clouds(2)[asked]
    expected, _ = cKDTree(others).query(points)
    np.testing.assert_allclose(nearest_m(points, others), expected, atol=1e-15)


@pytest.mark.parametrize("seed", range(3, 7))
@pytest.mark.parametrize("shape", clouds(0))
def test_the_worst_median_is_that_of_the_nearest_neighbours_in_reach(shape: str, seed: int) -> None:
    points = clouds(seed)[shape]
    values = np.random.default_rng(seed).uniform(size=len(points))
    worst, known = worst_median(points, values, RADIUS_M, 5, 24)
    tree, medians = cKDTree(points), []
    for point in points:
        near_m, index = tree.query(point, min(24, len(points)), distance_upper_bound=RADIUS_M)
        index = np.atleast_1d(index)[np.isfinite(np.atleast_1d(near_m))]
        if len(index) >= 5:
            medians.append(float(np.median(values[index])))
    assert known == len(medians)
    if not medians:
        assert np.isnan(worst)
    elif shape == "the same point":  # which 24 of the 30 are nearest nobody can tell
        assert values.min() < worst < values.max()
    else:
        assert worst == pytest.approx(max(medians), abs=1e-15)
