"""One arm keeps to the contract of a dVRK: states, goals, limits."""

import numpy as np
import pytest

from defras_bt.dvrk.stand_in.drive import joints_near
from defras_bt.dvrk.stand_in.operating import Operating
from defras_bt.dvrk.stand_in.psm import REPORTED_FROM_TIP, Psm
from defras_bt.dvrk.stand_in.refusal import Refused
from defras_sim.arm.dh import JOINT_HIGH, JOINT_SPEED
from defras_sim.arm.kinematics import tip_pose
from defras_sim.geometry import Pose

RCM_M = np.array([0.0, 0.09, 0.2])
HOME = np.array([0.1, -0.2, 0.12, 0.0, 0.2, -0.1])
PERIOD_S = 0.01


def arm(operating: Operating | None = None) -> Psm:
    return Psm(
        "PSM1",
        RCM_M,
        HOME,
        (),
        jaw_rad=0.0,
        period_s=PERIOD_S,
        operating=operating or Operating(),
    )


def run(psm: Psm, time_s: float) -> int:
    """Periods until the arm is idle, at most so long."""
    for count in range(round(time_s / PERIOD_S)):
        if not psm.reading().operating.is_busy:
            return count
        psm.advance(PERIOD_S)
    return round(time_s / PERIOD_S)


def test_it_reports_the_origin_of_the_wrist_yaw_axis():
    # github.com/jhu-saw/sawIntuitiveResearchKit, share/kinematic/PSM.json with a ProGrasp.
    psm = Psm("PSM1", RCM_M, np.array([0, 0, 0.12, 0, 0, 0.0]), (), jaw_rad=0.0,
              period_s=PERIOD_S, operating=Operating())  # fmt: skip
    assert psm.reading().measured.position_m == pytest.approx([0, 0, -0.1151], abs=1e-6)
    other = Psm("PSM1", RCM_M, np.array([0.2, 0.1, 0.14, 0, 0.2, -0.2]), (), jaw_rad=0.0,
                period_s=PERIOD_S, operating=Operating())  # fmt: skip
    expected = [0.026623, -0.015580, -0.131329]
    assert other.reading().measured.position_m == pytest.approx(expected, abs=2e-6)


def test_servo_goals_within_a_period_are_taken_at_once_and_others_refused():
    psm = arm()
    goal = psm.reading().setpoint.moved(np.array([0.0005, 0.0, -0.0005]))
    psm.servo_cp(goal)
    assert psm.reading().setpoint.position_m == pytest.approx(goal.position_m, abs=1e-9)
    with pytest.raises(Refused, match="one period's motion"):
        psm.servo_cp(goal.moved(np.array([0.02, 0.0, 0.0])))
    with pytest.raises(Refused, match="one period's motion"):
        psm.servo_jp(psm.reading().setpoint_joints + 2 * JOINT_SPEED * PERIOD_S)
    assert psm.reading().setpoint.position_m == pytest.approx(goal.position_m, abs=1e-9)


def test_moves_keep_speed_and_acceleration_and_make_the_arm_busy():
    psm, goal = arm(), HOME + np.array([0.4, 0.1, 0.03, 0.5, 0.1, 0.2])
    psm.move_jp(goal)
    assert psm.reading().operating.is_busy
    path = [HOME]
    while psm.reading().operating.is_busy:
        psm.advance(PERIOD_S)
        path.append(psm.reading().setpoint_joints)
    speed = np.diff(path, axis=0) / PERIOD_S
    assert path[-1] == pytest.approx(goal)
    assert np.all(np.abs(speed) <= JOINT_SPEED + 1e-6)
    most = np.array([np.pi / 2, np.pi / 2, 0.2, 4 * np.pi, 4 * np.pi, 4 * np.pi])
    assert np.all(np.abs(np.diff(speed, axis=0)) / PERIOD_S <= 1.05 * most)
    # Yaw rules: 0.4 rad from rest to rest at 90 degrees/s2.
    assert len(path) * PERIOD_S == pytest.approx(2 * np.sqrt(0.4 / (np.pi / 2)), rel=0.05)


def test_the_set_ratio_slows_a_move_on_its_way():
    slow, fast = arm(), arm()
    slow.set_ratio(0.2)
    for psm in (slow, fast):
        psm.move_jr(np.array([1.2, 0, 0, 0, 0, 0.0]))
    fast_s, slow_s = run(fast, 20.0) * PERIOD_S, run(slow, 20.0) * PERIOD_S
    assert fast_s == pytest.approx(2 * np.sqrt(1.2 / (np.pi / 2)), rel=0.03)
    # At a fifth of 90 degrees/s, with 0.2 s to get there and to brake.
    assert slow_s == pytest.approx(1.2 / (0.2 * np.pi / 2) + 0.2, rel=0.03)
    with pytest.raises(Refused, match="set_ratio"):
        slow.set_ratio(0.0)


@pytest.mark.parametrize("command", ["pause", "disable"])
def test_an_arm_that_is_stopped_keeps_its_place_and_its_grip(command):
    psm = arm()
    psm.jaw_servo_jp(0.8)
    for _ in range(60):
        psm.advance(PERIOD_S)
    psm.jaw_servo_jp(0.0)
    psm.move_jr(np.array([0.5, 0, 0, 0, 0, 0.0]))
    for _ in range(40):
        psm.advance(PERIOD_S)
    psm.state_command(command)
    at, jaw_rad = psm.reading().setpoint_joints, psm.jaw.setpoint_rad
    for _ in range(20):
        psm.advance(PERIOD_S)
    assert psm.reading().setpoint_joints == pytest.approx(at)
    assert psm.jaw.setpoint_rad == pytest.approx(jaw_rad)
    with pytest.raises(Refused, match=r"PAUSED|DISABLED"):
        psm.servo_cp(psm.reading().setpoint)
    psm.state_command("resume" if command == "pause" else "enable")
    psm.servo_cp(psm.reading().setpoint)


def test_a_fault_is_left_by_enabling_and_an_unhomed_arm_by_homing():
    psm = arm()
    psm.fail()
    with pytest.raises(Refused, match="FAULT"):
        psm.hold()
    with pytest.raises(Refused, match="while FAULT"):
        psm.state_command("resume")
    psm.state_command("enable")
    psm.state_command("unhome")
    with pytest.raises(Refused, match="not homed"):
        psm.move_jp(HOME)
    psm.state_command("home")
    assert psm.reading().operating.is_busy
    assert not psm.reading().operating.is_homed
    run(psm, 3.0)
    assert psm.reading().operating == Operating("ENABLED", True, False)
    with pytest.raises(Refused, match="unknown"):
        psm.state_command("dance")


def test_goals_beyond_joint_limits_are_refused():
    psm = arm()
    with pytest.raises(Refused, match="yaw would go to"):
        psm.move_jp(JOINT_HIGH + np.array([0.1, 0, 0, 0, 0, 0]))
    deep = Pose(np.array([0.0, 0.0, -0.4]), psm.reading().setpoint.rotation)
    with pytest.raises(Refused, match="insertion"):
        psm.move_cp(deep)
    with pytest.raises(Refused, match="finite"):
        psm.servo_cp(Pose(np.full(3, np.nan)))
    with pytest.raises(Refused, match="jaw goal"):
        psm.jaw_move_jp(2.0)


def test_a_jaw_move_makes_the_arm_busy_until_it_is_there():
    psm = arm()
    psm.jaw_move_jp(0.8)
    assert psm.reading().operating.is_busy
    assert run(psm, 2.0) * PERIOD_S == pytest.approx(0.8 / 4.0, abs=0.02)
    assert psm.jaw.setpoint_rad == pytest.approx(0.8, abs=0.01)


def test_a_velocity_goal_that_is_not_renewed_ends_in_a_hold():
    psm = arm()
    start = psm.reading().setpoint
    psm.servo_cv(np.array([0.02, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(50):
        psm.advance(PERIOD_S)
    way_m = psm.reading().setpoint.position_m - start.position_m
    assert way_m[1:] == pytest.approx([0, 0], abs=1e-6)
    assert 0.0015 < way_m[0] <= 0.0021


def test_twist_is_the_velocity_of_the_reported_point():
    psm = arm()
    change = np.array([0.3, 0.2, 0.02, 0.4, 0.3, 0.2]) * PERIOD_S
    for _ in range(3):
        psm.servo_jr(change)
        psm.advance(PERIOD_S)
    before = psm.reading().measured
    psm.servo_jr(change)
    psm.advance(PERIOD_S)
    reading = psm.reading()
    expected = (reading.measured.position_m - before.position_m) / PERIOD_S
    assert reading.twist[:3] == pytest.approx(expected, rel=0.02, abs=1e-5)


def test_the_reported_pose_leads_back_to_the_joints():
    reading = arm().reading()
    joints = joints_near(reading.measured @ REPORTED_FROM_TIP, HOME)
    assert joints == pytest.approx(HOME, abs=1e-9)
    assert tip_pose(joints).position_m == pytest.approx(tip_pose(HOME).position_m)
