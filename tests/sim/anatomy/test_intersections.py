import numpy as np
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
