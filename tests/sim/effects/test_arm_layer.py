"""Where a wrong arm really goes, and what it knows of that."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.arm.closed_form import joints_of
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects.arm_layer import ArmLayer
from defras_sim.effects.library import effect
from defras_sim.geometry import Pose
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

RCM_M = np.array([0.0, 0.09, 0.20])
NO_PULL = np.zeros(3)


def layer(**effects: dict[str, float]) -> ArmLayer:
    return ArmLayer(RCM_M, [(effect(name), values) for name, values in effects.items()])


def at(*position_m: float) -> Pose:
    return Pose(np.array(position_m), POINTING_DOWN)


def test_a_plain_arm_goes_where_it_is_told() -> None:
    arm = layer()
    goal = at(0.01, 0.02, 0.0)
    arm.follow(0.0, goal)
    assert arm.is_plain
    assert arm.tip(NO_PULL) is goal
    assert arm.measured() is goal
    with pytest.raises(RuntimeError, match="no set-point"):
        layer().tip(NO_PULL)


@pytest.mark.parametrize(
    "name", ["joint_offset", "joint_coupling", "joint_play", "servo_lag", "tool_offset"]
)
def test_at_null_values_it_goes_where_it_is_told(name: str) -> None:
    arm = layer(**{name: effect(name).complete({})})
    for step in range(5):
        goal = at(0.01 * step, 0.02, 0.0)
        arm.follow(0.1 * step, goal)
        tip = arm.tip(NO_PULL)
        assert np.allclose(tip.position_m, goal.position_m, atol=1e-12)
        assert np.allclose(tip.rotation, goal.rotation, atol=1e-12)


def test_an_offset_of_a_joint_moves_the_tip_by_forward_kinematics_and_is_not_seen() -> None:
    arm = layer(joint_offset={"q2_rad": 0.02})
    goal = at(0.01, 0.02, 0.0)
    arm.follow(0.0, goal)
    joints = joints_of(Pose(goal.position_m - RCM_M, goal.rotation))
    joints[1] += 0.02
    expected = tip_pose(joints).position_m + RCM_M
    assert np.allclose(arm.tip(NO_PULL).position_m, expected, atol=1e-12)
    assert arm.measured() is goal


def test_a_lag_is_seen_by_the_encoders() -> None:
    lags = {f"q{n}_s": 0.1 for n in range(1, 7)}
    arm = layer(servo_lag=lags)
    for step in range(21):
        arm.follow(0.05 * step, at(0.0, 0.02, 0.01 * 0.05 * step))
    late = at(0.0, 0.02, 0.01 * 0.9)
    assert np.allclose(arm.tip(NO_PULL).position_m, late.position_m, atol=1e-5)
    assert np.allclose(arm.measured().position_m, late.position_m, atol=1e-5)


def test_a_pulled_arm_gives_way_towards_the_tissue_unseen() -> None:
    arm = layer(arm_compliance={"z_m_per_n": 0.002})
    goal = at(0.0, 0.02, 0.03)
    arm.follow(0.0, goal)
    tip = arm.tip(np.array([0.0, 0.0, -0.5]))
    assert tip.position_m - goal.position_m == pytest.approx([0.0, 0.0, -0.001])
    assert arm.measured() is goal


def test_a_wrong_registration_is_the_same_rigid_motion_everywhere() -> None:
    arm = layer(tool_offset={"x_m": 0.003, "turn_z_rad": 0.1})
    tips = []
    goals = [at(0.0, 0.0, 0.0), at(0.05, 0.0, 0.0), at(0.0, 0.05, 0.02)]
    for number, goal in enumerate(goals):
        arm.follow(float(number), goal)
        tips.append(arm.tip(NO_PULL).position_m)
    assert tips[0] == pytest.approx([0.003, 0.0, 0.0])
    for tip, goal in zip(tips[1:], goals[1:], strict=True):
        assert np.linalg.norm(tip - tips[0]) == pytest.approx(np.linalg.norm(goal.position_m))
    assert tips[1][1] == pytest.approx(0.05 * np.sin(0.1))


def test_the_roll_never_jumps_by_a_turn() -> None:
    """A lag interpolates joints: over a jump it would swing the tip around the shaft."""
    arm = layer(servo_lag={"q4_s": 0.05})
    gaps_m = []
    for step in range(80):
        turn = 0.1 * step
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ POINTING_DOWN
        goal = Pose(np.array([0.0, 0.02, 0.0]), rotation)
        arm.follow(0.05 * step, goal)
        gaps_m.append(np.linalg.norm(arm.tip(NO_PULL).position_m - goal.position_m))
    assert max(gaps_m) < 0.003
