"""Moves a vector towards a goal with limits of speed, acceleration, braking and step."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class ApproachLimits:
    """``speed`` [m/s or rad/s]; ``acceleration`` and ``braking`` [per s again]; ``step`` [m or
    rad], the farthest in one go, however much time has passed."""

    speed: float
    acceleration: float
    braking: float
    step: float


class Approach:
    """``at`` (3,) and ``velocity`` (3,) of something that goes straight to ``goal`` (3,)."""

    def __init__(self, limits: ApproachLimits, start: Floats) -> None:
        self._limits = limits
        self.at: Floats = np.array(start, float)
        self.goal: Floats = self.at.copy()
        self.velocity: Floats = np.zeros(3)
        self._pace = 0.0

    def pursue(self, goal: Floats, pace: float) -> None:
        """Go to ``goal`` (3,), at most at ``pace``."""
        self.goal, self._pace = goal, min(pace, self._limits.speed)

    def stop(self) -> None:
        """Come to rest as soon as braking allows."""
        speed = _length(self.velocity)
        self.goal = self.at + self.velocity * (speed / (2.0 * self._limits.braking))
        self._pace = speed

    def step(self, elapsed_s: float) -> Floats:
        """The next ``at``, ``elapsed_s`` after the one before; without time nothing moves."""
        if elapsed_s <= 0.0:
            return self.at
        limits = self._limits
        way = self.goal - self.at
        distance = _length(way)
        if distance == 0.0:
            self.velocity = np.zeros(3)
            return self.at
        speed = min(self._pace, sqrt(2.0 * limits.braking * distance), distance / elapsed_s)
        wanted = way * (speed / distance)
        change = wanted - self.velocity
        slowing = speed < _length(self.velocity)
        most = (limits.braking if slowing else limits.acceleration) * elapsed_s
        self.velocity = self.velocity + _clipped(change, most)
        moved = _clipped(self.velocity * elapsed_s, limits.step)
        self.at = self.goal.copy() if _length(way - moved) < 1e-9 else self.at + moved
        return self.at


def _length(vector: Floats) -> float:
    return hypot(*vector.tolist())


def _clipped(vector: Floats, most: float) -> Floats:
    length = _length(vector)
    return vector if length <= most else vector * (most / length)
