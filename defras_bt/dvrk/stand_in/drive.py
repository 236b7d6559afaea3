"""The drive of one arm: where joints and tip really go, and what the encoders say.

The effects on arms (:mod:`defras_sim.effects`) are functions of a whole history. A stand-in runs
for hours at 100 Hz, so here the two that remember, servo_lag and joint_play, keep a state instead;
the others are asked for the present alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_sim.arm.closed_form import joints_of, turned_back
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects.arm_joints import JOINTS
from defras_sim.effects.effect import ArmEffect, Values
from defras_sim.effects.joint_play import JointPlay, drag_name, share_name, width_name
from defras_sim.effects.servo_lag import ServoLag
from defras_sim.geometry import Floats, Pose
from defras_sim.worlds.error import CannotImitate

_ROLL = 3
_WITHOUT_MEMORY = ("joint_coupling", "joint_offset")


class Drive:
    """One arm, told one set-point after the other. Joints (6,): rad, rad, m, rad, rad, rad."""

    def __init__(
        self, rcm_m: Floats, effects: Sequence[tuple[ArmEffect, Values]], start: Floats
    ) -> None:
        """``rcm_m`` (3,): the remote centre in the tissue frame; ``start`` (6,): at rest before.

        Raises:
            CannotImitate: an effect on the arm is neither of those above nor one of the tip.
        """
        self._rcm_m = np.asarray(rcm_m, float)
        self._effects = tuple(sorted(effects, key=lambda each: each[0].place))
        self._lag_s, self._lagging = np.zeros(6), np.asarray(start, float).copy()
        self._told, self._play = self._lagging.copy(), np.zeros((6, 3))
        self._behind = self._lagging.copy()
        self._drag = np.zeros((6, 6))
        for effect, values in self._effects:
            own = effect.complete(values)
            if isinstance(effect, ServoLag):
                self._lag_s = np.array([own[f"{q}_s"] for q in JOINTS])
            elif isinstance(effect, JointPlay):
                self._set_play(own)
            elif _acts_on_joints(effect) and effect.name not in _WITHOUT_MEMORY:
                raise CannotImitate(
                    f"the stand-in cannot imitate the effect {effect.name} on an arm; it knows "
                    f"servo_lag, joint_play, {', '.join(_WITHOUT_MEMORY)} and effects on the tip"
                )
        self._true = self._after_encoders(0.0)

    def follow(self, joints: Floats, time_s: float) -> None:
        """The set-point went straight to ``joints`` (6,) during the last ``time_s``."""
        told = np.asarray(joints, float)
        late = self._lag_s > 0.0
        passed = np.where(late, time_s / np.where(late, self._lag_s, 1.0), 1.0)
        left = np.exp(-passed)
        behind = np.where(passed > 0.0, -np.expm1(-passed) / np.maximum(passed, 1e-300), 1.0)
        followed = left * self._lagging + (1 - behind) * told + (behind - left) * self._told
        self._lagging = np.where(late, followed, told)
        self._told = told.copy()
        self._true = self._after_encoders(time_s)

    @property
    def encoded(self) -> Floats:
        """Joints (6,) as the encoders have them."""
        return self._lagging.copy()

    def tip(self, pull_n: Floats) -> Pose:
        """tissue_from_tip: where the tip really is, with the tissue pulling at it (3,) [N]."""
        base_from_tip = tip_pose(self._true)
        tip = Pose(base_from_tip.position_m + self._rcm_m, base_from_tip.rotation)
        for effect, values in self._effects:
            shift_m, turn_rad = effect.tip_error(
                values, tip.position_m[None], np.asarray(pull_n, float)[None], self._rcm_m
            )
            tip = tip.moved(shift_m[0], turn_rad[0])
        return tip

    def _set_play(self, own: Values) -> None:
        for i, joint in enumerate(JOINTS):
            self._play[i, 0], self._play[i, 1] = own[width_name(joint)], own[share_name(joint)]
            for j, other in enumerate(JOINTS):
                self._drag[j, i] = own.get(drag_name(other, joint), 0.0)

    def _after_encoders(self, time_s: float) -> Floats:
        """Joints (6,) behind slack cables, in the order of the drive."""
        joints = self._lagging.copy()
        for effect, values in self._effects:
            if isinstance(effect, JointPlay):
                half = 0.5 * self._play[:, 0]
                self._behind = np.clip(self._behind, joints - half, joints + half)
                lost = joints - self._behind
                joints = joints - self._play[:, 1] * lost + self._drag @ lost
            elif effect.name in _WITHOUT_MEMORY:
                joints = effect.joints(values, np.array([time_s]), joints[None])[0]
        return joints


def joints_near(base_from_tip: Pose, near: Floats) -> Floats:
    """Joints (6,) for the pose, the roll without a jump from ``near`` (6,).

    Raises:
        Undetermined: the wrist's yaw axis points at the remote centre.
    """
    joints = joints_of(base_from_tip)
    joints[_ROLL] = near[_ROLL] + turned_back(float(joints[_ROLL] - near[_ROLL]))
    return joints


def _acts_on_joints(effect: ArmEffect) -> bool:
    return type(effect).joints is not ArmEffect.joints
