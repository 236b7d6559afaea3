"""Giving up a grip that is not safe any more."""

from __future__ import annotations

from typing import Annotated, ClassVar

from py_trees.common import Status
from pydantic import Field

from defras_bt.acting.jaw import JAW_TIME_OUT_S
from defras_bt.executive.blackboard import Grip
from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.reasons import Code, Remedy
from defras_bt.executive.recovery import RecoveryLeaf
from defras_bt.executive.registry import register_node
from defras_sim.worlds.protocol import JAW_OPEN_RAD, ArmCommand


class GripUnsafeParameters(NodeParameters):
    """``patience_s``: how long the force may be over its threshold, or unknown."""

    patience_s: Annotated[float, Field(ge=0)] = 0.5


@register_node
class GripUnsafe(Node):
    """Succeeds if held tissue must be let go: force too high, or a mismatch nobody can explain."""

    role: ClassVar[Role] = "guard"
    Parameters = GripUnsafeParameters
    parameters: GripUnsafeParameters

    def update(self) -> Status:
        board = self.context.board
        if not board.grips:
            return self.fail(Code.NOTHING_HELD, "no arm holds tissue")
        over_s = board.force_over_s
        if over_s >= self.parameters.patience_s:
            return self.succeed(
                Code.FORCE, f"the force has been too high or unknown for {over_s:.2f} s"
            )
        state = board.warning_state
        if state is not None and state >= 2 and (board.unexplained or self._learned_in_vain()):
            return self.succeed(
                Code.UNEXPLAINED, f"warning state {state}, and the attachments do not explain it"
            )
        return self.fail(Code.SAFE, "the grip is safe")

    def _learned_in_vain(self) -> bool:
        """Learning stopped for just this and was believed, and the mismatch came back at once."""
        board = self.context.board
        last = board.last_learning
        return last is not None and last.warning_state >= 2 and last.tick < board.inputs.tick


class LetGoParameters(NodeParameters):
    """``again``: the same points may be grasped once more, unless it is for the second time."""

    again: bool = False


@register_node
class LetGo(RecoveryLeaf):
    """Open the jaws that hold tissue, without moving a tip, and block their grasp points.

    A jaw that does not open ends the run with a call for a human.
    """

    remedy: ClassVar[Remedy] = Remedy.LET_GO
    opens_jaws: ClassVar[bool] = True
    Parameters = LetGoParameters
    parameters: LetGoParameters

    def initialise(self) -> None:
        self._started_s = self.context.board.watched_s

    def recover(self) -> Status:
        board = self.context.board
        if not board.grips:
            return self.succeed(Code.LET_GO, "no arm holds tissue any more")
        for arm, grip in board.grips.items():
            self._give_up(arm, grip)
            board.move(arm, ArmCommand(jaw_rad=JAW_OPEN_RAD))
        if board.watched_s - self._started_s > JAW_TIME_OUT_S:
            return self._stuck()
        return self.run(Code.OPENING, "letting go of the tissue")

    def _give_up(self, arm: str, grip: Grip) -> None:
        """Remember the point, and tell of it once."""
        board, point = self.context.board, grip.point
        gone, known = f"{arm.upper()} lets go of the tissue at {point}; ", board.slipped.get(point)
        if self.parameters.again and known is None:
            board.slipped[point] = grip
            board.tell("hold", f"{gone}it may be grasped there once more.", "warning")
        elif not (self.parameters.again and known is grip) and point not in board.blocked:
            board.blocked.add(point)
            board.tell("hold", f"{gone}this grasp point will not be used again.", "warning")

    def _stuck(self) -> Status:
        """Tissue that must be let go and cannot be: only a human can help."""
        board = self.context.board
        arms = " and ".join(arm.upper() for arm in board.grips)
        why = f"{arms} should let go of the tissue but did not open within {JAW_TIME_OUT_S:g} s"
        board.tell("human", f"Motion stopped, a human is asked to take over: {why}.", "error")
        board.end("human", why, Code.JAW_STUCK)
        return self.fail(Code.JAW_STUCK, why)
