"""A move_* trajectory: all joints together, within their speeds and accelerations."""

from __future__ import annotations

import numpy as np

from defras_sim.arm.dh import JOINT_SPEED
from defras_sim.geometry import Floats

JOINT_ACCELERATION = np.array([np.pi / 2, np.pi / 2, 0.2, 4 * np.pi, 4 * np.pi, 4 * np.pi])
"""rad/s2; m/s2 of the insertion. saw-intuitive-research-kit, ``share/kinematic/PSM.json``."""

_NEARLY_THERE = 1e-6


class JointPath:
    """A straight way in joint space, begun and ended at rest, that can be slowed on the way."""

    def __init__(self, start: Floats, goal: Floats, speed: Floats, acceleration: Floats) -> None:
        """All (n,), SI."""
        self._start = np.asarray(start, float)
        self._way = np.asarray(goal, float) - self._start
        moving = np.abs(self._way) > 1e-12
        self._speed = float(np.min(speed[moving] / np.abs(self._way[moving]), initial=np.inf))
        self._acceleration = float(
            np.min(acceleration[moving] / np.abs(self._way[moving]), initial=np.inf)
        )
        self._share = 0.0 if moving.any() else 1.0
        self._share_per_s = 0.0

    @property
    def ended(self) -> bool:
        return self._share >= 1.0

    def advance(self, time_s: float, ratio: float) -> Floats:
        """Where the joints are (n,) after ``time_s`` more, at ``ratio`` (0..1) of their speeds."""
        left = 1.0 - self._share
        if left > 0.0:
            step = self._acceleration * time_s
            # Speeds that fall by one step a period cover v^2 / 2a + v dt / 2 until rest.
            braking = np.sqrt(step**2 / 4 + 2.0 * self._acceleration * left) - step / 2
            wanted = min(self._share_per_s + step, ratio * self._speed)
            self._share_per_s = min(max(wanted, self._share_per_s - step), float(braking))
            self._share += self._share_per_s * time_s
            if 1.0 - self._share < _NEARLY_THERE:
                self._share = 1.0
        return self._start + self._share * self._way


def joint_path(start: Floats, goal: Floats) -> JointPath:
    """The way of the six joints of a PSM."""
    return JointPath(start, goal, JOINT_SPEED, JOINT_ACCELERATION)
