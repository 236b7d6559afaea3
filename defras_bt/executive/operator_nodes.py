"""Leaves that follow the operator."""

from __future__ import annotations

from typing import Any, ClassVar

from py_trees.common import Status

from defras_bt.executive.node import Node, Role
from defras_bt.executive.reasons import Code
from defras_bt.executive.registry import register_node
from defras_bt.recording.operator_state import Mode

HOLDING_CODES = {Mode.PAUSED: Code.PAUSED, Mode.TAKEN_OVER: Code.TAKEN_OVER}


@register_node
class OperatorHolds(Node):
    """Succeeds while the operator has paused the operation or taken over the arms."""

    role: ClassVar[Role] = "guard"

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        if variable != "operator":
            return None
        return Status.SUCCESS if value in ("pauses", "drives") else Status.FAILURE

    def update(self) -> Status:
        operator = self.context.board.inputs.operator
        if not operator.holds:
            return self.fail(Code.PERMITTED, "the operator neither paused nor took over")
        return self.succeed(HOLDING_CODES[operator.mode], operator.reason)


@register_node
class WaitForOperator(Node):
    """Hold still, with the grip kept, for as long as the operator wants."""

    role: ClassVar[Role] = "task"

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        if variable != "operator":
            return None
        return Status.RUNNING if value in ("pauses", "drives") else Status.SUCCESS

    def update(self) -> Status:
        operator = self.context.board.inputs.operator
        if not operator.holds:
            return self.succeed(Code.PERMITTED, "the operator is not waited for")
        wanted = "resumes" if operator.mode is Mode.PAUSED else "hands back"
        return self.run(
            Code.OPERATOR_HOLDS, f"{operator.reason}; nothing moves until the operator {wanted}"
        )
