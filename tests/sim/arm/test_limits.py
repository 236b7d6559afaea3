"""Closed-form joints against forward kinematics, and motions against every limit of the arm."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from defras_sim.arm.closed_form import Undetermined, joints_of
from defras_sim.arm.dh import JOINT_HIGH, JOINT_NAMES, JOINT_SPEED, WRIST_TO_TIP_M
from defras_sim.arm.kinematics import joints_for, tip_pose
from defras_sim.arm.limits import LOW, ArmLimits
from defras_sim.geometry import Pose

RCM_M = np.array([0.0, 0.09, 0.20])
STRAIGHT = np.array([0.0, 0.0, 0.14, 0.0, 0.0, 0.0])
STILL = np.zeros(3)

shares = st.tuples(*[st.floats(0.0, 1.0)] * 6).map(np.array)


def place(joints) -> Pose:
    """tissue_from_tip of an arm whose remote centre stands at RCM_M."""
    tip = tip_pose(np.asarray(joints, float))
    return Pose(tip.position_m + RCM_M, tip.rotation)


@given(shares)
def test_joints_of_undoes_forward_kinematics(share):
    joints = LOW + share * (JOINT_HIGH - LOW)
    joints[3] = (2 * share[3] - 1) * 3.1  # beyond half a turn the roll is told as its equal
    np.testing.assert_allclose(joints_of(tip_pose(joints)), joints, atol=1e-9)


def test_it_agrees_with_the_iterative_solution():
    wanted = Pose(np.array([0.03, -0.02, -0.17]), np.diag([1.0, -1.0, -1.0]))
    iterated = joints_for(wanted, STRAIGHT)
    np.testing.assert_allclose(joints_of(wanted), iterated, atol=1e-4)


def test_it_also_says_where_the_joints_would_have_to_be_out_of_reach():
    joints = STRAIGHT + [0, 0, 0.3, 0, 0, 0]
    np.testing.assert_allclose(joints_of(tip_pose(joints)), joints, atol=1e-9)


def test_a_yaw_axis_through_the_remote_centre_is_refused():
    lying = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    origin_m = WRIST_TO_TIP_M * lying[:, 2] + 0.1 * lying[:, 0]
    with pytest.raises(Undetermined, match="turn the tip"):
        joints_of(Pose(origin_m, lying))


class TestAllowedMotion:
    LIMITS = ArmLimits(RCM_M)

    def test_a_motion_within_the_limits_is_allowed_whole(self):
        allowed = self.LIMITS.allowed(place(STRAIGHT), np.array([0.001, 0, 0]), STILL, 0.05)
        assert (allowed.share, allowed.reason) == (1.0, "")

    def test_insertion_ends_at_its_limit(self):
        near = STRAIGHT.copy()
        near[2] = JOINT_HIGH[2] - 0.001
        allowed = self.LIMITS.allowed(place(near), np.array([0, 0, -0.004]), STILL, 0.05)
        assert allowed.share == pytest.approx(0.25, abs=0.002)
        assert "insertion would go to 243.0 mm, allowed are 60.6 to 240.0" in allowed.reason

    def test_the_shaft_stays_beyond_the_remote_centre(self):
        near = STRAIGHT.copy()
        near[2] = LOW[2] + 0.001
        allowed = self.LIMITS.allowed(place(near), np.array([0, 0, 0.004]), STILL, 0.05)
        assert allowed.share == pytest.approx(0.25, abs=0.002)

    @pytest.mark.parametrize("joint", [0, 1, 4, 5])
    def test_no_joint_turns_beyond_its_limit(self, joint):
        """A small motion along the joint's own way out, from a hundredth of it away."""
        inside, outside = STRAIGHT.copy(), STRAIGHT.copy()
        step = 0.01
        inside[joint], outside[joint] = JOINT_HIGH[joint] - step / 100, JOINT_HIGH[joint] + step
        start, end = place(inside), place(outside)
        way_m = end.position_m - start.position_m
        turn = Rotation.from_matrix(end.rotation @ start.rotation.T).as_rotvec()
        allowed = self.LIMITS.allowed(start, way_m, turn, 1.0)
        assert allowed.share < 0.05
        assert allowed.reason.startswith(JOINT_NAMES[joint])

    def test_from_outside_a_limit_only_the_way_back_is_open(self):
        outside = STRAIGHT.copy()
        outside[2] = JOINT_HIGH[2] + 0.01
        tip = place(outside)
        assert self.LIMITS.allowed(tip, np.array([0, 0, -0.001]), STILL, 0.05).share == 0.0
        assert self.LIMITS.allowed(tip, np.array([0, 0, 0.001]), STILL, 0.05).share == 1.0

    def test_a_joint_that_would_race_slows_the_motion_down(self):
        """Near the remote centre a small motion of the tip is a large turn of the arm."""
        short = STRAIGHT.copy()
        short[2] = LOW[2] + 0.002
        lever_m = np.linalg.norm(tip_pose(short).position_m)
        way_m = 2 * JOINT_SPEED[0] * 0.05 * lever_m
        turn = np.array([0.0, -way_m / lever_m, 0.0])  # about the remote centre: the wrist rests
        allowed = self.LIMITS.allowed(place(short), np.array([way_m, 0, 0]), turn, 0.05)
        assert allowed.share == pytest.approx(0.5, abs=0.02)
        assert "yaw would move at" in allowed.reason

    @given(shares, st.tuples(*[st.floats(-0.02, 0.02)] * 3))
    def test_whatever_is_asked_the_end_keeps_the_limits(self, share, way):
        joints = LOW + share * (JOINT_HIGH - LOW)
        start, way_m = place(joints), np.array(way)
        allowed = self.LIMITS.allowed(start, way_m, STILL, 0.05)
        moved = start.moved(allowed.share * way_m)
        end = joints_of(Pose(moved.position_m - RCM_M, moved.rotation))
        angles = [0, 1, 2, 4, 5]
        assert (end[angles] <= JOINT_HIGH[angles] + 1e-9).all()
        assert (end[angles] >= LOW[angles] - 1e-9).all()
