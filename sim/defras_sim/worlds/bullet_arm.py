"""A PSM in PyBullet: Cartesian set-points through its own inverse kinematics to joint motors."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_sim.arm.dh import JOINT_SPEED
from defras_sim.arm.kinematics import Unreachable, joints_for, tip_pose
from defras_sim.effects.arm_layer import ArmLayer
from defras_sim.effects.grasp_layer import GraspLayer
from defras_sim.geometry import Floats, Pose
from defras_sim.resources import resource
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.force_sensor import NO_FORCE
from defras_sim.worlds.kinematic_tool import JAW_ON_TISSUE_RAD, JAW_SPEED_RAD_S
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, ArmCommand, ArmObservation

_JOINTS = range(6)
_JAW = (6, 7)
_TIP_LINK = 8
_START = np.array([0.0, 0.0, 0.12, 0.0, 0.0, 0.0])
_JOINT_FORCES = [100.0] * 6
_GRIP_MASS_KG = 0.05
_GRIP_FORCE_N = 1000.0
NATURAL_ROTATION = tip_pose(np.zeros(6)).rotation
"""tissue_from_tip of an instrument that points straight down without rolling (3, 3)."""


class BulletArm:
    """One arm, its jaw, and the body that carries what the jaw holds.

    The motors go where the effects on the arm make of the set-point. The carried tissue hangs on a
    small body fixed to the tip by a constraint, because a constraint tells its force and a link of
    the arm does not; effects on the grasp say where on the tip.
    """

    def __init__(
        self, client: Any, name: str, rcm_m: Floats, home_tip_m: Floats, layer: ArmLayer
    ) -> None:
        self._client = client
        self.name = name
        self._rcm_m = np.asarray(rcm_m, float)
        self._layer = layer
        self._time_s = 0.0
        self._body = client.loadURDF(
            str(resource("sim/robots/psm.urdf")), list(self._rcm_m), useFixedBase=True
        )
        self.setpoint = Pose(np.asarray(home_tip_m, float), NATURAL_ROTATION)
        self.setpoint_joints = self._solve(self.setpoint, _START)
        self._layer.follow(0.0, self.setpoint)
        self._target = self._layer.tip(NO_FORCE)
        self._target_joints = self._aimed(self.setpoint_joints)
        self.jaw_rad = JAW_CLOSED_RAD
        self._jaw_goal_rad = JAW_CLOSED_RAD
        for joint in _JOINTS:
            client.resetJointState(self._body, joint, self._target_joints[joint])
        self._show_jaw()
        self.grip = client.createMultiBody(_GRIP_MASS_KG, -1, -1, list(home_tip_m))
        self._fixed = client.createConstraint(
            self.grip, -1, -1, -1, client.JOINT_FIXED, [0, 0, 0], [0, 0, 0], list(home_tip_m)
        )
        self.anchors: list[int] = []
        self.held: GraspLayer | None = None
        self.armed = False

    def begin_tick(self, command: ArmCommand, tick_s: float, end_s: float) -> None:
        """Take the set-points to the end of the tick; they are approached over its sub-steps.

        ``end_s``: world time of that end.

        Raises:
            WorldError: the arm cannot go there.
        """
        self._time_s = end_s
        before, target_before = self.setpoint_joints, self._target_joints
        linear, angular = command.linear_m_s * tick_s, command.angular_rad_s * tick_s
        if np.any(linear) or np.any(angular):
            self.setpoint = self.setpoint.moved(linear, angular)
            self.setpoint_joints = self._solve(self.setpoint, self.setpoint_joints)
        speed = np.abs(self.setpoint_joints - before) / tick_s
        if np.any(speed > JOINT_SPEED):
            raise WorldError(
                f"{self.name}: joint speeds {np.round(speed, 2)} exceed the limits "
                f"{np.round(JOINT_SPEED, 2)}; command the tip slower"
            )
        self._layer.follow(end_s, self.setpoint)
        self._target = self._layer.tip(-self.force_on_tissue_n())
        self._from_joints, self._target_joints = target_before, self._aimed(target_before)
        self._joint_speed = (self._target_joints - target_before) / tick_s
        if command.jaw_rad is not None:
            self._jaw_goal_rad = command.jaw_rad
        self._move_jaw(JAW_SPEED_RAD_S * tick_s)

    def drive(self, share: float) -> None:
        """Set motors and grip for the sub-step that ends at ``share`` (0..1) of the tick."""
        wanted = self._from_joints + share * (self._target_joints - self._from_joints)
        self._client.setJointMotorControlArray(
            self._body,
            list(_JOINTS),
            self._client.POSITION_CONTROL,
            targetPositions=list(wanted),
            targetVelocities=list(self._joint_speed),
            positionGains=[0.5] * 6,
            velocityGains=[1.0] * 6,
            forces=_JOINT_FORCES,
        )
        if self.anchors:
            jaw = self._jaw()
            self._client.changeConstraint(
                self._fixed,
                list(jaw.position_m),
                list(_relative(jaw).quaternion_xyzw),
                maxForce=_GRIP_FORCE_N,
            )

    def joints(self) -> Floats:
        """Where the joints truly are (6,)."""
        states = self._client.getJointStates(self._body, list(_JOINTS))
        return np.array([state[0] for state in states])

    def tip(self) -> Pose:
        """tissue_from_tip: where the tip truly is."""
        return self._to_tissue(tip_pose(self.joints()))

    def carry(self) -> Pose:
        """Bring the carrying body to where the jaw holds, ready to be anchored to; its pose."""
        jaw = self._jaw()
        turn = _relative(jaw).quaternion_xyzw
        self._client.resetBasePositionAndOrientation(self.grip, list(jaw.position_m), list(turn))
        self._client.changeConstraint(
            self._fixed, list(jaw.position_m), list(turn), maxForce=_GRIP_FORCE_N
        )
        return Pose(jaw.position_m, _relative(jaw).rotation)

    def force_on_tissue_n(self) -> Floats:
        """True force (3,) of the jaw on the tissue, along the tissue frame; 0 without a grip."""
        if not self.anchors:
            return NO_FORCE
        return np.array(self._client.getConstraintState(self._fixed)[:3])

    def observe(self, time_s: float, force_n: Floats | None) -> ArmObservation:
        """``force_n`` (3,): what a force sensor says; None without one."""
        joints, tip = self._encoded()
        return ArmObservation(
            stamp_s=time_s,
            tissue_from_tip=tip,
            setpoint_tissue_from_tip=self.setpoint,
            jaw_rad=self.jaw_rad,
            # A jaw that was told to close and stands open has something between its ends.
            grasped=self._jaw_goal_rad < JAW_ON_TISSUE_RAD <= self.jaw_rad and bool(self.anchors),
            joints=joints,
            setpoint_joints=self.setpoint_joints,
            force_n=force_n,
        )

    def _encoded(self) -> tuple[Floats, Pose]:
        """Joints (6,) and tissue_from_tip as the encoders have them."""
        joints = self.joints()
        tip = self._to_tissue(tip_pose(joints))
        if self._layer.is_plain:
            return joints, tip
        # Motors miss their goal by a little; encoders see that, and not what is behind them.
        seen = self._layer.measured() @ (self._target.inverse() @ tip)
        return self._solve(seen, joints), seen

    def _aimed(self, start: Floats) -> Floats:
        """Joints (6,) at which the motors aim."""
        if self._layer.is_plain:
            return self.setpoint_joints
        return self._solve(self._target, start)

    def _jaw(self) -> Pose:
        """tissue_from_jaw: where the jaw truly holds what it holds."""
        tip = self.tip()
        return tip if self.held is None else self.held.held(self._time_s, tip)

    def _move_jaw(self, most_rad: float) -> None:
        turned = self.jaw_rad + np.clip(self._jaw_goal_rad - self.jaw_rad, -most_rad, most_rad)
        lowest = JAW_ON_TISSUE_RAD if self.anchors else JAW_CLOSED_RAD
        self.jaw_rad = max(float(turned), lowest)
        self._show_jaw()

    def _show_jaw(self) -> None:
        for joint in _JAW:
            self._client.resetJointState(self._body, joint, self.jaw_rad / 2)

    def _solve(self, tissue_from_tip: Pose, start: Floats) -> Floats:
        base_from_tip = Pose(tissue_from_tip.position_m - self._rcm_m, tissue_from_tip.rotation)
        try:
            return joints_for(base_from_tip, start)
        except Unreachable as error:
            raise WorldError(f"{self.name}: {error}") from error

    def _to_tissue(self, base_from_tip: Pose) -> Pose:
        return Pose(base_from_tip.position_m + self._rcm_m, base_from_tip.rotation)


def _relative(tip: Pose) -> Pose:
    """The carrying body starts unturned, whatever the instrument's natural rotation."""
    return Pose(tip.position_m, tip.rotation @ NATURAL_ROTATION.T)
