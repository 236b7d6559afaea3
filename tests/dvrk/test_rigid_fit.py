"""Registration: known motions come back, and what fixes no pose is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.registering.rigid_fit import NotRegistered, rigid_fit
from defras_sim.geometry import Pose

CORNERS_M = np.array([[-0.06, -0.06, 0], [0.06, -0.06, 0], [0.06, 0.06, 0], [-0.06, 0.06, 0]])


@given(st.integers(0, 2**31))
def test_an_exact_motion_comes_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = Pose(rng.uniform(-0.5, 0.5, 3), Rotation.random(random_state=seed).as_matrix())
    child_m = CORNERS_M + rng.uniform(-0.01, 0.01, CORNERS_M.shape)
    fit = rigid_fit(pose.apply(child_m), child_m)
    np.testing.assert_allclose(fit.parent_from_child.position_m, pose.position_m, atol=1e-9)
    np.testing.assert_allclose(fit.parent_from_child.rotation, pose.rotation, atol=1e-9)
    assert fit.rms_m < 1e-12
    assert fit.scale == pytest.approx(1.0)


def test_scipy_finds_the_same_pose_of_noisy_landmarks() -> None:
    rng = np.random.default_rng(5)
    child_m = rng.uniform(-0.1, 0.1, (7, 3))
    parent_m = Rotation.from_rotvec([0.4, -1.0, 2.0]).apply(child_m) + [0.1, 0.2, 0.3]
    parent_m = parent_m + 0.002 * rng.standard_normal(parent_m.shape)
    fit = rigid_fit(parent_m, child_m)
    turn, missed = Rotation.align_vectors(
        parent_m - parent_m.mean(axis=0), child_m - child_m.mean(axis=0)
    )
    np.testing.assert_allclose(fit.parent_from_child.rotation, turn.as_matrix(), atol=1e-8)
    assert fit.rms_m == pytest.approx(missed / np.sqrt(7))


def test_a_mirrored_set_is_not_turned_inside_out() -> None:
    child_m = np.vstack([CORNERS_M, [0.0, 0.0, 0.05]])
    fit = rigid_fit(child_m * [1.0, 1.0, -1.0], child_m)
    assert np.linalg.det(fit.parent_from_child.rotation) == pytest.approx(1.0)
    assert fit.rms_m > 0.01


def test_one_bad_landmark_shows_most_when_it_is_left_out() -> None:
    child_m = np.vstack([CORNERS_M, [0.0, 0.0, 0.0], [0.03, 0.0, 0.02]])
    parent_m = child_m.copy()
    parent_m[3] += [0.0, 0.0, 0.006]
    fit = rigid_fit(parent_m, child_m)
    assert int(np.argmax(fit.left_out_m)) == 3
    assert fit.left_out_m[3] == pytest.approx(0.006)
    assert fit.left_out_m[3] > fit.residuals_m[3]


@pytest.mark.parametrize(
    ("parent_m", "child_m", "says"),
    [
        (CORNERS_M[:3], CORNERS_M[:3], "at least 4"),
        (
            np.outer(np.arange(5), [0.01, 0.02, 0.0]),
            np.outer(np.arange(5), [0.0, 0.0, 0.022]),
            "line",
        ),
        (CORNERS_M, CORNERS_M * 1000, "millimetres"),
        (CORNERS_M, CORNERS_M * 1.5, "1.5 times"),
        (CORNERS_M, CORNERS_M * np.nan, "not a number"),
        (CORNERS_M, CORNERS_M[:, :2], "shapes"),
    ],
)
def test_what_fixes_no_pose_is_refused(
    parent_m: np.ndarray, child_m: np.ndarray, says: str
) -> None:
    with pytest.raises(NotRegistered, match=says):
        rigid_fit(parent_m, child_m)
