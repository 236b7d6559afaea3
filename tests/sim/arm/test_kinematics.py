"""PSM kinematics against published vectors, finite differences and random round trips."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.arm.dh import (
    JOINT_HIGH,
    JOINT_LOW,
    SHAFT_BEYOND_RCM_M,
    WRIST_TO_TIP_M,
    link_poses,
)
from defras_sim.arm.kinematics import Unreachable, jacobian, joints_for, tip_pose
from defras_sim.geometry import Pose


def random_joints(rng: np.random.Generator) -> np.ndarray:
    joints = rng.uniform(0.7 * JOINT_LOW, 0.7 * JOINT_HIGH)
    joints[2] = rng.uniform(SHAFT_BEYOND_RCM_M + 0.02, 0.2)
    return joints


@pytest.mark.parametrize(
    ("joints", "wrist_m"),
    [
        ((0, 0, 0.12, 0, 0, 0), (0, 0, -0.1151)),
        ((0.2, 0.1, 0.14, 0, 0.2, -0.2), (0.026623, -0.015580, -0.131329)),
    ],
)
def test_published_forward_kinematics(joints, wrist_m):
    found = link_poses(np.array(joints, float))[-1].position_m
    # The published vectors are rounded; theirs and these rows agree to 1.4 micrometres.
    np.testing.assert_allclose(found, wrist_m, atol=2e-6)


def test_the_tip_is_beyond_the_wrist_and_points_down_at_rest():
    joints = np.array([0, 0, 0.12, 0, 0, 0.0])
    tip = tip_pose(joints)
    np.testing.assert_allclose(tip.position_m, [0, 0, -0.1151 - WRIST_TO_TIP_M], atol=1e-9)
    np.testing.assert_allclose(tip.rotation[:, 2], [0, 0, -1], atol=1e-9)


def test_the_shaft_passes_through_the_remote_centre():
    rng = np.random.default_rng(0)
    for _ in range(100):
        links = link_poses(random_joints(rng))
        end, axis = links[3].position_m, links[3].rotation[:, 2]
        away_m = np.linalg.norm(np.cross(-end, axis))
        assert away_m < 1e-4


def test_jacobian_is_the_slope_of_forward_kinematics():
    rng = np.random.default_rng(1)
    step = 1e-6
    for _ in range(10):
        joints = random_joints(rng)
        found = jacobian(joints)
        for index in range(6):
            up, down = joints.copy(), joints.copy()
            up[index] += step
            down[index] -= step
            a, b = tip_pose(up), tip_pose(down)
            slope = (a.position_m - b.position_m) / (2 * step)
            turn = Rotation.from_matrix(a.rotation @ b.rotation.T).as_rotvec() / (2 * step)
            np.testing.assert_allclose(found[:, index], [*slope, *turn], atol=1e-6)


def test_inverse_undoes_forward():
    rng = np.random.default_rng(2)
    for _ in range(50):
        joints = random_joints(rng)
        start = np.clip(joints + rng.uniform(-0.05, 0.05, 6), JOINT_LOW, JOINT_HIGH)
        found = joints_for(tip_pose(joints), start)
        reached, wanted = tip_pose(found), tip_pose(joints)
        assert np.linalg.norm(reached.position_m - wanted.position_m) < 1e-6
        assert np.abs(reached.rotation - wanted.rotation).max() < 1e-4
        assert np.all(found >= JOINT_LOW)
        assert np.all(found <= JOINT_HIGH)


def test_a_pose_out_of_reach_is_refused_in_words():
    far = Pose(np.array([0.0, 0.0, -0.4]), tip_pose(np.zeros(6)).rotation)
    with pytest.raises(Unreachable, match=r"misses by .* mm"):
        joints_for(far, np.array([0, 0, 0.12, 0, 0, 0.0]))


def test_the_shaft_never_leaves_the_cannula():
    shallow = Pose(np.array([0.0, 0.0, -0.05]), tip_pose(np.zeros(6)).rotation)
    with pytest.raises(Unreachable):
        joints_for(shallow, np.array([0, 0, 0.12, 0, 0, 0.0]))


def test_every_grasp_point_can_be_retracted(demo_like_scene):
    scene = demo_like_scene
    down = tip_pose(np.zeros(6)).rotation
    for arm in scene.arms.values():
        start = joints_for(Pose(np.subtract(arm.home_tip_m, arm.rcm_m), down), np.zeros(6) + 0.1)
        side = 1 if arm.side == "+y" else -1
        for column in range(1, 6):
            for row in range(1, 6):
                x_m, y_m = scene.grasp_xy_m(column, row)
                if side * y_m < 0:
                    continue
                for dx_m, z_m in ((0, 0), (0, 0.04), (0.03, 0.04), (0.08, 0.04)):
                    tip_m = np.array([min(x_m + dx_m, 0.1), y_m, z_m])
                    joints_for(Pose(tip_m - arm.rcm_m, down), start)
