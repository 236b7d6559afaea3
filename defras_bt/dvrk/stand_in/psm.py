"""One patient-side manipulator as a dVRK has it, without ROS: states, goals, joints.

The reported point is the origin of the wrist's yaw axis, turned like the tip; the frame of the
remote centre is the base frame. Nothing here reads a clock: :meth:`Psm.advance` is told the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.dvrk.stand_in.drive import Drive, joints_near
from defras_bt.dvrk.stand_in.jaw import Jaw
from defras_bt.dvrk.stand_in.joint_path import JointPath, joint_path
from defras_bt.dvrk.stand_in.operating import ENABLED, FAULT, Operating
from defras_bt.dvrk.stand_in.refusal import Refused
from defras_sim.arm.closed_form import Undetermined
from defras_sim.arm.dh import JOINT_HIGH, JOINT_NAMES, JOINT_SPEED, WRIST_TO_TIP_M
from defras_sim.arm.kinematics import jacobian, tip_pose
from defras_sim.arm.limits import LOW
from defras_sim.effects.effect import ArmEffect, Values
from defras_sim.geometry import Floats, Pose

HOMING_S = 1.0
VELOCITY_GOAL_LASTS_S = 0.1
"""A servo_cv goal that is not renewed ends in a hold."""

REPORTED_FROM_TIP = Pose(np.array([0.0, 0.0, WRIST_TO_TIP_M]))
"""The tip in the frame that ``measured_cp`` reports."""


@dataclass(frozen=True)
class PsmReading:
    """What one arm publishes at an instant. Poses are base_from_reported."""

    operating: Operating
    measured_joints: Floats
    measured_speeds: Floats
    setpoint_joints: Floats
    measured: Pose
    setpoint: Pose
    twist: Floats
    """Linear (3,) [m/s], then angular (3,) [rad/s], of the reported point in the base frame."""
    jaw_rad: float
    jaw_setpoint_rad: float


class Psm:
    """One arm. Its methods are the commands of CRTK; one that is not carried out is refused."""

    def __init__(
        self,
        name: str,
        rcm_m: Floats,
        home_joints: Floats,
        effects: Sequence[tuple[ArmEffect, Values]],
        *,
        jaw_rad: float,
        period_s: float,
        operating: Operating,
        encoder_noise: Callable[[], Floats] | None = None,
    ) -> None:
        """``rcm_m`` (3,): the true remote centre in the tissue frame. ``period_s``: of
        :meth:`advance`, and the step within which servo goals must be reached.
        ``encoder_noise`` gives that of one reading of the joints (6,)."""
        self.name = name
        self.drive = Drive(rcm_m, effects, home_joints)
        self.jaw = Jaw(jaw_rad)
        self.operating = operating
        self.ratio = 1.0
        self._period_s = period_s
        self._setpoint = np.asarray(home_joints, float).copy()
        self._path: JointPath | None = None
        self._twist: Floats | None = None
        self._twist_left_s = 0.0
        self._homing_left_s = 0.0
        self._encoder_noise = encoder_noise
        self._encoded = self.drive.encoded
        self._speeds = np.zeros(6)

    def state_command(self, command: str) -> None:
        """enable, disable, pause, resume, home, unhome."""
        following = self.operating.after(command)
        if command == "home" and not self.operating.is_homed:
            following = replace(following, is_homed=False)
            self._homing_left_s = HOMING_S
        self.operating = following
        if not following.may_move:
            self._stop()

    def fail(self) -> None:
        """Something is wrong with the arm: FAULT."""
        self.operating = replace(self.operating, state=FAULT)
        self._stop()

    def servo_jp(self, joints: Floats) -> None:
        """Be at ``joints`` (6,) at once: within one period's motion of the set-point."""
        self.operating.require_motion("servo_jp")
        self._servo("servo_jp", self._allowed("servo_jp", joints))

    def servo_jr(self, change: Floats) -> None:
        """As :meth:`servo_jp`, counted from the set-point."""
        self.operating.require_motion("servo_jr")
        self._servo("servo_jr", self._allowed("servo_jr", self._setpoint + change))

    def servo_cp(self, base_from_reported: Pose) -> None:
        """Be at a pose at once: within one period's motion of the set-point."""
        self.operating.require_motion("servo_cp")
        self._servo("servo_cp", self._joints_for("servo_cp", base_from_reported))

    def servo_cv(self, twist: Floats) -> None:
        """Go on with a twist (6,) of the reported point, for at most 0.1 s."""
        self.operating.require_motion("servo_cv")
        self._path = None
        self._twist, self._twist_left_s = np.asarray(twist, float), VELOCITY_GOAL_LASTS_S

    def move_jp(self, joints: Floats) -> None:
        """Go to ``joints`` (6,) on a trajectory."""
        self.operating.require_motion("move_jp")
        self._move(self._allowed("move_jp", joints))

    def move_jr(self, change: Floats) -> None:
        """As :meth:`move_jp`, counted from the set-point."""
        self.operating.require_motion("move_jr")
        self._move(self._allowed("move_jr", self._setpoint + change))

    def move_cp(self, base_from_reported: Pose) -> None:
        """Go to a pose on a trajectory, straight in joint space."""
        self.operating.require_motion("move_cp")
        self._move(self._joints_for("move_cp", base_from_reported))

    def hold(self) -> None:
        """Stay where the set-point is; the jaw stays too."""
        self.operating.require_motion("hold")
        self._stop()

    def free(self) -> None:
        """Motors off but for the arm's weight: it stays where it is, and follows no goal."""
        self.operating.require_motion("free")
        self._stop()
        self._setpoint = self.drive.encoded

    def jaw_servo_jp(self, angle_rad: float) -> None:
        self.operating.require_motion("jaw/servo_jp")
        self.jaw.go_to(angle_rad, as_move=False)

    def jaw_move_jp(self, angle_rad: float) -> None:
        self.operating.require_motion("jaw/move_jp")
        self.jaw.go_to(angle_rad, as_move=True)

    def set_ratio(self, ratio: float) -> None:
        """Slow ``move_*`` to a share of its speeds.

        Raises:
            Refused: it is not over 0 and at most 1.
        """
        if not 0.0 < ratio <= 1.0:
            raise Refused(f"trajectory_j/set_ratio {ratio:g} refused: over 0, at most 1")
        self.ratio = ratio

    def advance(self, time_s: float) -> None:
        """Let ``time_s`` pass."""
        if self._homing_left_s > 0.0:
            self._homing_left_s -= time_s
            if self._homing_left_s <= 0.0 and self.operating.state == ENABLED:
                self.operating = replace(self.operating, is_homed=True)
        if self._path is not None:
            self._setpoint = self._path.advance(time_s, self.ratio)
            self._path = None if self._path.ended else self._path
        elif self._twist is not None:
            self._follow_twist(time_s)
        self.jaw.advance(time_s, self.ratio)
        self.drive.follow(self._setpoint, time_s)
        before, self._encoded = self._encoded, self.drive.encoded
        if self._encoder_noise is not None:
            self._encoded = self._encoded + self._encoder_noise()
        self._speeds = (self._encoded - before) / time_s

    def reading(self) -> PsmReading:
        """What is to be published now."""
        joints = self._encoded
        measured, setpoint = _reported(joints), _reported(self._setpoint)
        twist = jacobian(joints) @ self._speeds
        # The Jacobian is that of the tip.
        lever_m = measured.position_m - (measured @ REPORTED_FROM_TIP).position_m
        twist[:3] += np.cross(twist[3:], lever_m)
        busy = self._path is not None or self.jaw.busy or self._homing_left_s > 0.0
        return PsmReading(
            operating=replace(self.operating, is_busy=busy),
            measured_joints=joints.copy(),
            measured_speeds=self._speeds.copy(),
            setpoint_joints=self._setpoint.copy(),
            measured=measured,
            setpoint=setpoint,
            twist=twist,
            jaw_rad=self.jaw.measured_rad,
            jaw_setpoint_rad=self.jaw.setpoint_rad,
        )

    def _stop(self) -> None:
        self._path = self._twist = None
        self.jaw.hold()

    def _servo(self, command: str, joints: Floats) -> None:
        step = np.abs(joints - self._setpoint)
        most = JOINT_SPEED * self._period_s
        if np.any(step > most):
            worst = int(np.argmax(step / most))
            raise Refused(
                f"{command} refused: {JOINT_NAMES[worst]} would step by {step[worst]:.4f}, one "
                f"period's motion is {most[worst]:.4f}; use move_* for longer ways"
            )
        self._path = self._twist = None
        self._setpoint = joints

    def _move(self, joints: Floats) -> None:
        self._twist = None
        self._path = joint_path(self._setpoint, joints)

    def _follow_twist(self, time_s: float) -> None:
        twist = self._twist
        self._twist_left_s -= time_s
        if twist is None or self._twist_left_s <= 0.0:
            self._twist = None
            return
        goal = _reported(self._setpoint).moved(twist[:3] * time_s, twist[3:] * time_s)
        joints = self._joints_for("servo_cv", goal)
        most = JOINT_SPEED * time_s
        self._setpoint = self._setpoint + np.clip(joints - self._setpoint, -most, most)

    def _joints_for(self, command: str, base_from_reported: Pose) -> Floats:
        rotation = base_from_reported.rotation
        if not np.isfinite(base_from_reported.position_m).all() or not np.isfinite(rotation).all():
            raise Refused(f"{command} refused: the goal is not finite")
        try:
            joints = joints_near(base_from_reported @ REPORTED_FROM_TIP, self._setpoint)
        except Undetermined as error:
            raise Refused(f"{command} refused: {error}") from error
        return self._allowed(command, joints)

    def _allowed(self, command: str, joints: Floats) -> Floats:
        goal = np.asarray(joints, float)
        if goal.shape != (6,) or not np.isfinite(goal).all():
            raise Refused(f"{command} refused: it needs six finite joint positions")
        outside = np.flatnonzero((goal < LOW - 1e-9) | (goal > JOINT_HIGH + 1e-9))
        if len(outside):
            joint = int(outside[0])
            raise Refused(
                f"{command} refused: {JOINT_NAMES[joint]} would go to {goal[joint]:.4f}, allowed "
                f"are {LOW[joint]:.4f} to {JOINT_HIGH[joint]:.4f}"
            )
        return goal


def _reported(joints: Floats) -> Pose:
    """base_from_reported for joints (6,)."""
    return tip_pose(joints) @ REPORTED_FROM_TIP.inverse()
