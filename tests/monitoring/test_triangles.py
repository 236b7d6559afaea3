"""Bounds on distances to triangles hold, and cubes list every triangle that reaches into them."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.monitoring.triangle_cells import triangle_cells
from defras_bt.monitoring.triangles import bound, planes_of, square_to
from defras_sim.geometry import Floats


def triangles(kind: str) -> Floats:
    """Corners (60, 3, 3) of triangles within about 0.1 m."""
    rng = np.random.default_rng(len(kind))
    corners = rng.uniform(-0.1, 0.1, (60, 1, 3)) + rng.normal(0.0, 0.02, (60, 3, 3))
    if kind == "slivers":
        middle = corners[:, :2].mean(axis=1)
        corners[:, 2] = middle + 10.0 ** rng.uniform(-9, -4, (60, 1)) * rng.normal(size=(60, 3))
    if kind == "points":
        corners[:] = corners[:, :1]
    return corners


@pytest.mark.parametrize("kind", ["ordinary", "slivers", "points"])
def test_no_triangle_is_nearer_than_its_bound_and_over_its_face_just_as_near(kind: str) -> None:
    corners = triangles(kind)
    planes = planes_of(corners)
    over_faces = 0
    for point in np.random.default_rng(3).uniform(-0.15, 0.15, (300, 3)):
        for t in range(len(corners)):
            square, known = bound(tuple(point), planes, t)
            exact = square_to(tuple(point), corners, t)
            assert np.sqrt(square) <= np.sqrt(exact) + 1e-12
            if known:
                over_faces += 1
                assert np.sqrt(square) == pytest.approx(np.sqrt(exact), abs=1e-12)
    assert over_faces > 100 or kind != "ordinary"


def test_every_cube_lists_the_triangles_with_a_place_in_it() -> None:
    corners = triangles("ordinary")
    cells = triangle_cells(corners)
    for weights in np.random.default_rng(4).dirichlet(np.ones(3), 50):
        places = np.einsum("k,tkd->td", weights, corners)
        cubes = ((places - cells.low_m) / cells.side_m).astype(int)
        for t, cube in enumerate(np.ravel_multi_index(cubes.T, cells.shape)):
            assert t in cells.listed[cells.first[cube] : cells.first[cube + 1]]
