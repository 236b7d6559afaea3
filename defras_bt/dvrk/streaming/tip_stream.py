"""One tip's set-points, from the velocities it is commanded."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.settings import Stream
from defras_bt.dvrk.streaming.approach import Approach, ApproachLimits
from defras_sim.geometry import Floats, Pose

_CATCH_UP = 1.1
"""So much faster than commanded the stream may go to make good what it is behind."""
_BEHIND_TICKS = 0.5
"""So much it stays behind: a command that comes a little late finds it still moving."""
_SLOWER = 0.999
_SAME_WAY = 0.9
_MOST_TICKS_BEHIND = 2.0


@dataclass(frozen=True)
class TipVelocity:
    """Of the tip in the arm's frame: ``linear_m_s`` (3,), ``angular_rad_s`` (3,)."""

    linear_m_s: Floats = field(default_factory=lambda: np.zeros(3))
    angular_rad_s: Floats = field(default_factory=lambda: np.zeros(3))

    @property
    def moves(self) -> bool:
        return bool(self.linear_m_s.any() or self.angular_rad_s.any())


class TipStream:
    """Turns velocities for a tick each into poses for a period each.

    A command adds its way to where the tip was sent before: silence is a hold, and a command that
    comes a little late costs nothing, because the stream is a little behind. One that is slower
    than the last, or goes elsewhere, counts from where the stream is, and so slows it with the
    next set-point. No command at all stops it as braking allows.
    """

    def __init__(self, limits: Stream, start: Pose) -> None:
        """``start``: frame_from_tip."""
        self._place = Approach(
            ApproachLimits(
                limits.speed_m_s, limits.acceleration_m_s2, limits.braking_m_s2, limits.step_m
            ),
            start.position_m,
        )
        turning = ApproachLimits(
            limits.turning_rad_s, limits.turning_rad_s2, limits.turning_rad_s2, limits.step_rad
        )
        self._turn = Approach(turning, np.zeros(3))
        self._start = start.rotation
        self._last = TipVelocity()

    @property
    def pose(self) -> Pose:
        """frame_from_tip of the latest set-point."""
        return Pose(self._place.at.copy(), self._turned(self._turn.at))

    @property
    def goal(self) -> Pose:
        """frame_from_tip that the tip was last told to go to."""
        return Pose(self._place.goal.copy(), self._turned(self._turn.goal))

    @property
    def moving(self) -> bool:
        """Whether the next set-point may differ from the latest."""
        return not (
            np.array_equal(self._place.at, self._place.goal)
            and np.array_equal(self._turn.at, self._turn.goal)
        )

    def command(self, velocity: TipVelocity, tick_s: float) -> None:
        """Move on at ``velocity`` for ``tick_s``; a velocity of zero stops."""
        _follow(self._place, velocity.linear_m_s, self._last.linear_m_s, tick_s)
        _follow(self._turn, velocity.angular_rad_s, self._last.angular_rad_s, tick_s)
        self._last = velocity

    def stop(self) -> None:
        """Come to rest as soon as braking allows; what was left to go is given up."""
        self._place.stop()
        self._turn.stop()
        self._last = TipVelocity()

    def wait(self) -> None:
        """Stand still for this period, with what is left to go kept."""
        self._place.velocity = np.zeros(3)
        self._turn.velocity = np.zeros(3)

    def step(self, elapsed_s: float) -> Pose:
        """The next set-point, frame_from_tip, ``elapsed_s`` after the one before."""
        self._place.step(elapsed_s)
        self._turn.step(elapsed_s)
        return self.pose

    def _turned(self, turn_rad: Floats) -> Floats:
        if not turn_rad.any():
            return self._start
        return Rotation.from_rotvec(turn_rad).as_matrix() @ self._start


def _follow(approach: Approach, wanted: Floats, last: Floats, tick_s: float) -> None:
    speed, speed_before = float(np.linalg.norm(wanted)), float(np.linalg.norm(last))
    if speed == 0.0:
        approach.stop()
        return
    goes_on = (
        speed >= _SLOWER * speed_before
        and float(wanted @ last) >= _SAME_WAY * speed * speed_before > 0.0
    )
    goal = (approach.goal if goes_on else approach.at) + wanted * tick_s
    ahead = goal - approach.at
    most = _MOST_TICKS_BEHIND * speed * tick_s
    length = float(np.linalg.norm(ahead))
    if length > most:
        goal = approach.at + ahead * (most / length)
    behind = length > (1.0 + _BEHIND_TICKS) * speed * tick_s
    approach.pursue(goal, _CATCH_UP * speed if behind else speed)
