"""Where held tissue is taken and carried, for any effects on arm and grasp, without any tissue.

Effects of these two layers reach the tissue only through the place at which a jaw takes it and the
path along which the jaw carries it. Both follow from the set-points in milliseconds, as effects
act on whole histories; what the tissue does then is a matter of two responses that all share.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.arm.closed_form import joints_of, turned_back
from defras_sim.arm.kinematics import tip_pose
from defras_sim.effects.effect import ArmEffect
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.recorded_motion import ArmMotion
from defras_sim.scene import Scene

_ROLL = 3


@dataclass(frozen=True)
class HeldPath:
    """One grip of ``arm``: ``frames`` (m,) in which it holds. ``taken``: tissue_from_jaw when it
    closed; ``position_m`` (m, 3), ``rotation`` (m, 3, 3): tissue_from_jaw of the held patch."""

    arm: str
    frames: Integers
    taken: Pose
    position_m: Floats
    rotation: Floats


@dataclass(frozen=True)
class Carried:
    """How a grip differs from another one, in the tissue frame: ``beside_m`` (3,) is how far beside
    the other's place it takes the tissue. ``farther_m`` (m, 3) and ``turned_rad`` (m, 3) are how
    much farther than the other it has carried and turned it since."""

    beside_m: Floats
    farther_m: Floats
    turned_rad: Floats

    @staticmethod
    def between(one: HeldPath, other: HeldPath) -> Carried:
        beside = other.taken.position_m - one.taken.position_m
        way_of_one = one.rotation @ one.taken.rotation.T
        way_of_other = other.rotation @ other.taken.rotation.T
        turn = way_of_other @ np.swapaxes(way_of_one, 1, 2)
        return Carried(
            beside,
            other.position_m - one.position_m - beside,
            Rotation.from_matrix(turn).as_rotvec() if len(turn) else np.zeros((0, 3)),
        )


class Paths:
    """Paths of one trajectory under any effects; joints of the set-points are found once."""

    def __init__(self, scene: Scene, trajectory: Trajectory) -> None:
        self._scene = scene
        self._trajectory = trajectory
        self._joints: dict[str, Floats] = {}

    def held(self, layers: Layers, forces_n: Mapping[str, Floats]) -> tuple[HeldPath, ...]:
        """All grips in order of time. ``forces_n`` (f, 3) of each jaw on the tissue are those of
        the frames, and change little from one model to the next."""
        found = []
        motion = self._trajectory.motion
        for name, arm in motion.arms.items():
            starts = np.flatnonzero(np.diff(arm.grasped.astype(np.int8), prepend=0) == 1)
            ends = np.flatnonzero(np.diff(arm.grasped.astype(np.int8), append=0) == -1)
            for first, last in zip(starts, ends, strict=True):
                found.append(self._grip(name, int(first), int(last), layers, forces_n[name]))
        return tuple(sorted(found, key=lambda grip: int(grip.frames[0]) if len(grip.frames) else 0))

    def measured_m(self, layers: Layers, arm: str) -> Floats:
        """Where the encoders of ``arm`` say its tip is in every frame (f, 3)."""
        seen = tuple(each for each in layers.arm if each[0].encoders_see)
        rows = self._trajectory.frames
        return self._tips(arm, Layers(arm=seen), rows, np.zeros((len(rows), 3)))[0]

    def _grip(self, arm: str, first: int, last: int, layers: Layers, force_n: Floats) -> HeldPath:
        frames = self._trajectory.frames
        mine = np.flatnonzero((frames >= first) & (frames <= last))
        # What slips depends on the whole way; else the frames are enough.
        rows = np.arange(first, last + 1) if layers.grasp else np.union1d([first], frames[mine])
        pull = -np.stack(
            [np.interp(rows, frames, np.nan_to_num(force_n[:, k])) for k in range(3)], axis=1
        )
        pull[0] = 0.0
        position, rotation = self._tips(arm, layers, rows, pull)
        tip = jaw = Pose(position[0], rotation[0])
        for effect, values in layers.grasp:
            jaw = effect.point(values, jaw)
        tip_from_jaw = tip.inverse() @ jaw
        time_s = self._trajectory.motion.time_s[rows]
        slipped = np.zeros_like(position)
        for effect, values in layers.grasp:
            slipped = slipped + effect.slipped_m(values, time_s, position)
        carried = position + rotation @ tip_from_jaw.position_m + slipped
        at = np.searchsorted(rows, frames[mine])
        return HeldPath(arm, mine, jaw, carried[at], (rotation @ tip_from_jaw.rotation)[at])

    def _tips(
        self, arm: str, layers: Layers, rows: Integers, pull_n: Floats
    ) -> tuple[Floats, Floats]:
        """True tips at ``rows`` (m,): positions (m, 3), rotations (m, 3, 3)."""
        told = self._trajectory.motion.arms[arm]
        rcm_m = np.array({str(n): a.rcm_m for n, a in self._scene.arms.items()}[arm])
        position, rotation = told.position_m[rows], told.rotation[rows]
        on_joints = [each for each in layers.arm if type(each[0]).joints is not ArmEffect.joints]
        if on_joints:
            joints = self._joints_of(arm, rcm_m)
            for effect, values in on_joints:
                joints = effect.joints(values, self._trajectory.motion.time_s, joints)
            tips = [tip_pose(joints[row]) for row in rows]
            position = np.array([tip.position_m for tip in tips]) + rcm_m
            rotation = np.array([tip.rotation for tip in tips])
        for effect, values in layers.arm:
            shift, turn = effect.tip_error(values, position, pull_n, rcm_m)
            position = position + shift
            rotation = Rotation.from_rotvec(turn).as_matrix() @ rotation
        return position, rotation

    def _joints_of(self, arm: str, rcm_m: Floats) -> Floats:
        """Joints (n, 6) of all set-points, the roll without jumps."""
        if arm not in self._joints:
            motion = self._trajectory.motion.arms[arm]
            found = np.empty((len(motion.position_m), 6))
            for row in range(len(found)):
                if row and _same(motion, row, row - 1):
                    found[row] = found[row - 1]
                    continue
                tip = motion.tip(row)
                found[row] = joints_of(Pose(tip.position_m - rcm_m, tip.rotation))
                if row:
                    before = found[row - 1, _ROLL]
                    found[row, _ROLL] = before + turned_back(float(found[row, _ROLL] - before))
            self._joints[arm] = found
        return self._joints[arm]


def _same(motion: ArmMotion, row: int, other: int) -> bool:
    return np.array_equal(motion.position_m[row], motion.position_m[other]) and np.array_equal(
        motion.rotation[row], motion.rotation[other]
    )
