import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defras_sim.anatomy.intersections import first_intersection
from tests.sim.anatomy.organs import lumpy_body, lumpy_sheet

NUMBERS = np.array([[0, 1, 2], [3, 4, 5]])


def apart(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether some plane through the origin's directions separates two triangles (SAT)."""
    sides = [np.diff(np.vstack([t, t[:1]]), axis=0) for t in (one, other)]
    axes = [np.cross(s[0], s[1]) for s in sides]
    axes += [np.cross(a, b) for a in sides[0] for b in sides[1]]
    for axis in axes:
        if np.linalg.norm(axis) < 1e-12:
            continue
        p, q = one @ axis, other @ axis
        if p.max() < q.min() or q.max() < p.min():
            return True
    return False


@given(st.integers(0, 100_000))
def test_pairs_of_triangles_are_judged_as_separating_planes_do(seed):
    corners = np.random.default_rng(seed).uniform(-1, 1, (6, 3))
    found = first_intersection(corners, NUMBERS)
    assert (found is None) == apart(corners[:3], corners[3:])
    if found is not None:
        for triangle in (corners[:3], corners[3:]):
            normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
            normal /= np.linalg.norm(normal)
            assert abs((found - triangle[0]) @ normal) < 1e-6


def test_neighbours_do_not_cut_each_other():
    for organ in (lumpy_body(), lumpy_sheet()):
        assert first_intersection(np.asarray(organ.vertices), np.asarray(organ.faces)) is None


def test_triangles_with_one_common_corner_may_cut_each_other():
    vertices = np.array([[0, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, -1], [1, 0.2, 1.0]])
    assert first_intersection(vertices, np.array([[0, 1, 2], [0, 3, 4]])) is not None
    assert first_intersection(vertices + [0, 0, 0], np.array([[0, 1, 2]])) is None


def sheet(along_m: np.ndarray, across_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners and triangles of the profile ``along_m`` (n, 2) in x and z, drawn out along y."""
    rows, columns = len(along_m), len(across_m)
    x, z = np.repeat(along_m, columns, axis=0).T
    vertices = np.column_stack([x, np.tile(across_m, rows), z])
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    corner, beyond = first + 1, first + columns
    halves = ([first, beyond, beyond + 1], [first, beyond + 1, corner])
    return vertices, np.concatenate([np.column_stack(half) for half in halves])


@pytest.mark.parametrize("cells", [5, 8, 16, 32])
@pytest.mark.parametrize("turn_rad", [0.0, 0.3])
def test_regular_sheets_do_not_cut_themselves(cells, turn_rad):
    """Their sides are parallel, but for rounding."""
    x = np.linspace(0, 0.08, cells + 1)
    turn = np.array([[np.cos(turn_rad), -np.sin(turn_rad), 0], [0.2, 1, 0.1], [0, 0.3, 1]])
    for z in (0 * x, 0.1 * x, 0.3 * x, 10 * x, 0.004 * np.sin(40 * x)):
        vertices, triangles = sheet(np.column_stack([x, z]), x)
        assert first_intersection(vertices, triangles) is None
        tilted = vertices + np.outer(vertices[:, 1], [0, 0, 0.1])
        assert first_intersection(tilted, triangles) is None
        assert first_intersection(vertices @ turn, triangles) is None


@pytest.mark.parametrize("slope", [1.0, 0.1, 1e-3, 1e-6])
@pytest.mark.parametrize("cells", [1, 7, 16])
def test_a_sheet_that_runs_back_through_itself_is_found(cells, slope):
    """It rises to the right, turns round, and rises to the left: it meets itself half-way."""
    x = np.linspace(0, 0.06, cells + 1)
    there = np.column_stack([x, slope * x])
    back = np.column_stack([x[::-1], slope * x])
    turn = np.array([[0.07, 0.06 * slope + 0.01], [0.08, 0.0], [0.07, -0.01]])
    found = first_intersection(*sheet(np.vstack([there, turn, back]), np.linspace(0, 0.04, 6)))
    assert found is not None
    assert found[[0, 2]] == pytest.approx([0.03, 0.03 * slope], rel=1e-6)
