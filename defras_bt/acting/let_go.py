"""Giving up a grip that is not safe any more."""

from __future__ import annotations

from typing import Annotated, ClassVar

from py_trees.common import Status
from pydantic import Field

from defras_bt.acting.jaw import JAW_TIME_OUT_S
from defras_bt.executive.node import Node, NodeParameters, Role
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
            return self.fail("nothing_held", "no arm holds tissue")
        over_s = board.force_over_s
        if over_s >= self.parameters.patience_s:
            return self.succeed(
                "force", f"the force has been too high or unknown for {over_s:.2f} s"
            )
        state = board.warning_state
        if state is not None and state >= 2 and board.unexplained:
            return self.succeed(
                "unexplained", f"warning state {state}, and the attachments do not explain it"
            )
        return self.fail("safe", "the grip is safe")


@register_node
class LetGo(Node):
    """Open the jaws that hold tissue, without moving a tip, and block their grasp points."""

    role: ClassVar[Role] = "recovery"

    def initialise(self) -> None:
        self._started_s = self.context.board.inputs.time_s

    def update(self) -> Status:
        board = self.context.board
        if not board.grips:
            return self.succeed("let_go", "no arm holds tissue any more")
        for arm, grip in board.grips.items():
            if grip.point not in board.blocked:
                board.blocked.add(grip.point)
                board.tell(
                    "hold",
                    f"{arm.upper()} lets go of the tissue at {grip.point}; "
                    "this grasp point will not be used again.",
                    "warning",
                )
            board.move(arm, ArmCommand(jaw_rad=JAW_OPEN_RAD))
        if board.inputs.time_s - self._started_s > JAW_TIME_OUT_S:
            return self.fail("time_out", f"a jaw did not open within {JAW_TIME_OUT_S:g} s")
        return self.run("opening", "letting go of the tissue")
