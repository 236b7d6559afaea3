"""The jaw of an arm: its set-point, and where the tissue between its ends lets it go."""

from __future__ import annotations

import numpy as np

from defras_bt.dvrk.stand_in.refusal import Refused
from defras_sim.worlds.kinematic_tool import JAW_SPEED_RAD_S

LOWEST_RAD, HIGHEST_RAD = -0.349, 1.396
"""saw-intuitive-research-kit, ``share/tool/PROGRASP_FORCEPS_400093.json``."""

_THERE_RAD = 0.01


class Jaw:
    """Goes to its goal at its own speed; what it holds stops it (:attr:`measured_rad`)."""

    def __init__(self, angle_rad: float) -> None:
        self.setpoint_rad = angle_rad
        self.measured_rad = angle_rad
        """Told by whoever knows the tissue."""
        self.busy = False
        """A jaw move is under way."""
        self.goal_rad = angle_rad

    def go_to(self, goal_rad: float, *, as_move: bool) -> None:
        """Turn to ``goal_rad``; a move makes the arm busy until it is there.

        Raises:
            Refused: it is no angle of this jaw.
        """
        if not LOWEST_RAD <= goal_rad <= HIGHEST_RAD:
            raise Refused(
                f"jaw goal {goal_rad:.3f} rad refused: this jaw goes from {LOWEST_RAD} to "
                f"{HIGHEST_RAD} rad"
            )
        self.goal_rad = goal_rad
        self.busy = as_move

    def hold(self) -> None:
        """Stay; what is held is held on to."""
        self.goal_rad = self.setpoint_rad
        self.busy = False

    def advance(self, time_s: float, ratio: float) -> None:
        """Let ``time_s`` pass; moves are slowed by ``ratio`` (0..1), servo goals are not."""
        most_rad = JAW_SPEED_RAD_S * time_s * (ratio if self.busy else 1.0)
        self.setpoint_rad += float(np.clip(self.goal_rad - self.setpoint_rad, -most_rad, most_rad))
        if abs(self.goal_rad - self.setpoint_rad) < _THERE_RAD:
            self.busy = False
