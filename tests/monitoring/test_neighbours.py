"""Nearest points of a cloud, against a k-d tree."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from defras_bt.monitoring.neighbours import nearest_m
from tests.monitoring.point_clouds import clouds


@pytest.mark.parametrize("shape", clouds(0))
@pytest.mark.parametrize("asked", ["sheet", "ball", "sheet and one far away"])
def test_the_nearest_is_as_near_as_a_tree_says(shape: str, asked: str) -> None:
    others, points = clouds(1)[shape], clouds(2)[asked]
    expected, _ = cKDTree(others).query(points)
    np.testing.assert_allclose(nearest_m(points, others), expected, atol=1e-15)
