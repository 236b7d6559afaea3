"""A tool that moves exactly as commanded, with a jaw of finite speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, JAW_OPEN_RAD, ArmCommand

# The tip's z axis is the approach direction.
POINTING_DOWN = np.diag([1.0, -1.0, -1.0])

JAW_SPEED_RAD_S = 4.0
JAW_ON_TISSUE_RAD = 0.15
"""Angle at which a jaw that closes on tissue stops; above it, an opening jaw lets go."""
ARMED_ABOVE_RAD = 0.75 * JAW_OPEN_RAD
"""Only a jaw that was wider open than this takes tissue when it closes."""


@dataclass
class KinematicTool:
    """Tip pose, jaw and grip of one arm.

    Only a jaw that comes from wide open takes tissue: a closed jaw that touches it cannot.
    """

    tissue_from_tip: Pose
    jaw_rad: float = JAW_CLOSED_RAD
    jaw_goal_rad: float = JAW_CLOSED_RAD
    grasped: bool = False
    _armed: bool = False

    @classmethod
    def at(cls, tip_m: Floats) -> KinematicTool:
        """A tool with a closed jaw at ``tip_m`` (3,), pointing down."""
        return cls(Pose(np.asarray(tip_m, float), POINTING_DOWN))

    def step(self, command: ArmCommand, time_s: float, on_tissue: Callable[[Pose], bool]) -> bool:
        """Carry out ``command`` for ``time_s``; returns whether tip or grip changed.

        ``on_tissue`` is asked once, when a closing jaw would meet tissue held between its ends.
        """
        linear, angular = command.linear_m_s * time_s, command.angular_rad_s * time_s
        moved = bool(np.any(linear) or np.any(angular))
        if moved:
            self.tissue_from_tip = self.tissue_from_tip.moved(linear, angular)
        if command.jaw_rad is not None:
            self.jaw_goal_rad = command.jaw_rad
        return self._move_jaw(JAW_SPEED_RAD_S * time_s, on_tissue) or moved

    def _move_jaw(self, most_rad: float, on_tissue: Callable[[Pose], bool]) -> bool:
        """Turn the jaw towards its goal; returns whether the grip changed."""
        turned = self.jaw_rad + np.clip(self.jaw_goal_rad - self.jaw_rad, -most_rad, most_rad)
        if self.grasped:
            self.jaw_rad = max(float(turned), JAW_ON_TISSUE_RAD)
            self.grasped = self.jaw_rad <= JAW_ON_TISSUE_RAD + 1e-9
            return not self.grasped
        meets = self._armed and turned <= JAW_ON_TISSUE_RAD < self.jaw_rad
        self.jaw_rad = float(turned)
        self._armed = turned > ARMED_ABOVE_RAD or (self._armed and turned > JAW_ON_TISSUE_RAD)
        if meets and on_tissue(self.tissue_from_tip):
            self.jaw_rad, self.grasped = JAW_ON_TISSUE_RAD, True
        return self.grasped
