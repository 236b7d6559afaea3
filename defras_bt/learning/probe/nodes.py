"""The leaf that looks actively: a small, safe tug at held tissue where learning is in doubt."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from py_trees.common import Status

from defras_bt.acting.arm_action import ARRIVED_M
from defras_bt.acting.manoeuvre import SETTLE_S
from defras_bt.executive.node import Node, Role
from defras_bt.executive.reasons import Code
from defras_bt.executive.registry import register_node
from defras_bt.learning.probe.choice import Tug, explanations_of
from defras_sim.geometry import Floats
from defras_sim.worlds.protocol import ArmCommand


@register_node
class ProbeAttachments(Node):
    """Tug at the held tissue where that tells most about attachments that learning left in doubt.

    The tug is the one after which the belief and what else is possible would look most different,
    with a force below the threshold under each of them. One tug per attempt to learn: after it
    there is something new to learn from. As any motion it has to stand under guards.
    """

    role: ClassVar[Role] = "motion"

    def initialise(self) -> None:
        self._tug: Tug | None = None
        self._target_m: Floats | None = None
        self._arrived_s: float | None = None

    def update(self) -> Status:
        board = self.context.board
        if not board.grips:
            return self.fail(Code.NOTHING_HELD, "nothing is held that could be tugged at")
        if self._tug is None:
            refused = self._choose()
            if refused is not None:
                return refused
        tug, target_m = self._tug, self._target_m
        assert tug is not None
        assert target_m is not None
        if tug.arm not in board.grips:
            return self.fail(Code.NOT_HOLDING, f"{tug.arm.upper()} has lost the tissue")
        setpoint_m = self._setpoint_m(tug.arm)
        way = target_m - setpoint_m
        distance_m = float(np.linalg.norm(way))
        if distance_m > ARRIVED_M:
            self._arrived_s = None
            scene = self.context.scene
            # Half as fast as planned motion: nobody has rehearsed this one before the operation.
            speed = min(0.5 * scene.motion.tissue_speed_m_s, distance_m / scene.tick_s)
            board.move(tug.arm, ArmCommand(linear_m_s=way * (speed / distance_m)))
            return self.run(Code.MOVING, f"{tug.arm.upper()} tugs at the tissue to learn")
        now_s = board.inputs.time_s
        if self._arrived_s is None:
            self._arrived_s = now_s
        if now_s - self._arrived_s < SETTLE_S:
            return self.run(Code.SETTLING, f"{tug.arm.upper()} waits for the tissue to settle")
        board.posterior = None
        return self.succeed(Code.PROBED, f"{tug.arm.upper()} has tugged at the tissue to learn")

    def _choose(self) -> Status | None:
        """Choose a tug, or report why there is none."""
        board, context = self.context.board, self.context
        if board.posterior is None:
            return self.fail(
                Code.NOT_DOUBTFUL, "nothing about the attachments was left in doubt since the grasp"
            )
        scene = context.scene
        explanations = explanations_of(scene, board.posterior)
        if len(explanations) < 2:
            board.posterior = None
            return self.fail(Code.NOT_DOUBTFUL, "learning left no attachment in doubt")
        threshold_n = board.inputs.force_threshold_n
        frames = context.keyframes.frames()
        tug = context.probe.choose(scene, frames, explanations, threshold_n) if frames else None
        if tug is None or tug.arm not in board.grips:
            board.posterior = None
            return self.fail(
                Code.NO_SAFE_TUG, "no small tug is safe and would tell anything about attachments"
            )
        self._tug, self._target_m = tug, self._setpoint_m(tug.arm) + tug.way_m
        board.tell(
            "probe",
            f"{tug.arm.upper()} tugs by {1e3 * float(np.linalg.norm(tug.way_m)):.0f} mm: what may "
            f"hold the tissue would then differ by {1e3 * tug.parts_m:.1f} mm instead of "
            f"{1e3 * tug.now_m:.1f} mm.",
            data={"way_m": tug.way_m.tolist(), "force_n": tug.force_n, "parts_m": tug.parts_m},
        )
        return None

    def _setpoint_m(self, arm: str) -> Floats:
        observed = self.context.board.inputs.observation.arms[arm]
        return observed.commanded_tissue_from_tip.position_m
