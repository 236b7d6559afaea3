"""Reach: bring the tip onto a grasp point from above."""

from __future__ import annotations

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

    def update(self) -> Status:
        board, scene = self.context.board, self.context.scene
        if self.arm in board.grips:
            return self.fail(Code.HOLDING, f"{self.who} holds tissue and cannot reach elsewhere")
        speed = scene.motion.reach_speed_m_s
        goal_m = scene.grasp_point_m(*self.point)
        board.at.pop(self.arm, None)
        if self.go(self._waypoint_m(goal_m), speed) and np.allclose(
            self.setpoint_m, goal_m, atol=ARRIVED_M
        ):
            board.at[self.arm] = self.point
            return self.finish(f"{self.who} has reached grasp point {self.point}.")
        return self.run(Code.MOVING, f"{self.who} is on its way to grasp point {self.point}")

    def _waypoint_m(self, goal_m: Floats) -> Floats:
        tip_m = self.setpoint_m
        scene = self.context.scene
        clearance_m = float(scene.tissue.shape.high_m[2]) + scene.motion.clearance_m
        if np.linalg.norm(goal_m[:2] - tip_m[:2]) <= 2 * ARRIVED_M:
            return goal_m
        if tip_m[2] < clearance_m - ARRIVED_M:
            return np.array([*tip_m[:2], clearance_m])
        return np.array([*goal_m[:2], max(clearance_m, tip_m[2])])
