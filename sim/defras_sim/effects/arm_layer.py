"""ArmLayer: where one arm's tip really goes when it is told where to go."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_sim.arm.closed_form import joints_of, turned_back
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects.effect import ArmEffect, Values
from defras_sim.effects.history import History
from defras_sim.geometry import Floats, Pose

_ROLL = 3


class ArmLayer:
    """One arm, told one set-point after the other.

    Effects on joints see the set-point's joints since the first one; those on the tip see the tip
    that comes of them, and the pull of the tissue.
    """

    def __init__(self, rcm_m: Floats, effects: Sequence[tuple[ArmEffect, Values]]) -> None:
        """``rcm_m`` (3,): the arm's remote centre of motion in the tissue frame."""
        self._rcm_m = np.asarray(rcm_m, float)
        self._effects = tuple(sorted(effects, key=lambda each: each[0].place))
        self._on_joints = [each for each in self._effects if _acts_on_joints(each[0])]
        self._joints = History(6)
        self._setpoint: Pose | None = None
        self._moved: Pose | None = None

    @property
    def is_plain(self) -> bool:
        """Whether the tip goes exactly where it is told to go."""
        return not self._effects

    def follow(self, time_s: float, tissue_from_tip: Pose) -> None:
        """The arm is told to be at a pose at ``time_s``; what was told for later is forgotten.

        Raises:
            Undetermined: no joints can be told for the pose.
        """
        self._setpoint = self._moved = tissue_from_tip
        if self._on_joints:
            self._joints.add(time_s, self._joints_at(tissue_from_tip))
            self._moved = self._tip_after(self._on_joints)

    def tip(self, pull_n: Floats) -> Pose:
        """tissue_from_tip: where the tip really is, with the tissue pulling at it (3,) [N]."""
        tip = self._moved
        if tip is None:
            raise RuntimeError("the arm was told no set-point yet; call follow first")
        for effect, values in self._effects:
            shift_m, turn_rad = effect.tip_error(
                values, tip.position_m[None], np.asarray(pull_n, float)[None], self._rcm_m
            )
            tip = tip.moved(shift_m[0], turn_rad[0])
        return tip

    def measured(self) -> Pose:
        """tissue_from_tip: where the arm believes its tip, by its encoders."""
        if self._setpoint is None:
            raise RuntimeError("the arm was told no set-point yet; call follow first")
        seen = [each for each in self._on_joints if each[0].encoders_see]
        return self._tip_after(seen) if seen else self._setpoint

    def _tip_after(self, effects: Sequence[tuple[ArmEffect, Values]]) -> Pose:
        joints = self._joints.values
        for effect, values in effects:
            joints = effect.joints(values, self._joints.time_s, joints)
        base_from_tip = tip_pose(joints[-1])
        return Pose(base_from_tip.position_m + self._rcm_m, base_from_tip.rotation)

    def _joints_at(self, tissue_from_tip: Pose) -> Floats:
        """Joints (6,), the roll without a jump from the last one."""
        joints = joints_of(Pose(tissue_from_tip.position_m - self._rcm_m, tissue_from_tip.rotation))
        if len(self._joints):
            before = self._joints.values[-1, _ROLL]
            joints[_ROLL] = before + turned_back(float(joints[_ROLL] - before))
        return joints


def _acts_on_joints(effect: ArmEffect) -> bool:
    return type(effect).joints is not ArmEffect.joints
