"""Reach: bring the tip onto a grasp point from above."""

from __future__ import annotations

from math import dist

import numpy as np
from py_trees.common import Status

from defras_bt.acting.arm_action import ARRIVED_M, ArmAction
from defras_bt.executive.reasons import Code
from defras_bt.executive.registry import register_node
from defras_sim.geometry import Floats


@register_node
class Reach(ArmAction):
    """Bring the tip onto a grasp point: up to clearance, across, and straight down."""

    spoken = "reach"

    def initialise(self) -> None:
        super().initialise()
        scene = self.context.scene
        self._goal_m = scene.grasp_point_m(*self.point)
        self._clearance_m = float(scene.tissue.shape.high_m[2]) + scene.motion.clearance_m

    def update(self) -> Status:
        board = self.context.board
        if self.arm in board.grips:
            return self.fail(Code.HOLDING, f"{self.who} holds tissue and cannot reach elsewhere")
        board.at.pop(self.arm, None)
        waypoint_m = self._waypoint_m()
        there = self.go(waypoint_m, self.context.scene.motion.reach_speed_m_s)
        if there and waypoint_m is self._goal_m:
            board.at[self.arm] = self.point
            return self.finish(f"{self.who} has reached grasp point {self.point}.")
        return self.run(Code.MOVING, f"{self.who} is on its way to grasp point {self.point}")

    def _waypoint_m(self) -> Floats:
        """The next corner (3,) of the way; the goal itself once the tip is over it."""
        tip_m, goal_m = self.setpoint_m, self._goal_m
        if dist(goal_m[:2].tolist(), tip_m[:2].tolist()) <= 2 * ARRIVED_M:
            return goal_m
        if tip_m[2] < self._clearance_m - ARRIVED_M:
            return np.array([*tip_m[:2], self._clearance_m])
        return np.array([*goal_m[:2], max(self._clearance_m, tip_m[2])])
