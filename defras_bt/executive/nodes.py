"""Leaves that pace, pause and end an operation."""

from __future__ import annotations

from math import isnan
from typing import Annotated, ClassVar

from py_trees.common import Status
from pydantic import Field

from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.operator_nodes import HOLDING_CODES
from defras_bt.executive.reasons import Code, Remedy, helps
from defras_bt.executive.registry import register_node
from defras_bt.recording.record import Cause


class RateParameters(NodeParameters):
    """``slow``: the rate under warning state 1, or while the force is over its threshold."""

    slow: Annotated[float, Field(gt=0, le=1)] = 0.5


class WaitParameters(NodeParameters):
    """``seconds`` of world time."""

    seconds: Annotated[float, Field(gt=0)]


class Task(Node):
    """Base of leaves that are neither guard, motion nor recovery."""

    role: ClassVar[Role] = "task"


@register_node
class AdaptRate(Task):
    """Choose the rate of motion from its nominal value: full, or slow when something is off."""

    Parameters = RateParameters
    parameters: RateParameters

    def update(self) -> Status:
        board = self.context.board
        reasons = []
        if (board.warning_state or 0) >= 1:
            reasons.append(f"warning state {board.warning_state}")
        if board.inputs.force_over:
            force_n = board.inputs.force_n
            reasons.append("unknown force" if isnan(force_n) else f"{force_n:.2f} N")
        if not reasons:
            return self.succeed(Code.NOMINAL, "motion at full speed")
        board.rate = self.parameters.slow
        return self.succeed(Code.SLOWED, f"slowed to {board.rate:.0%}: {', '.join(reasons)}")


@register_node
class CalibrateRest(Task):
    """Watch the untouched tissue until monitoring knows its noise."""

    def update(self) -> Status:
        calibration = self.context.monitor.calibration
        if not calibration:
            return self.run(Code.WATCHING, "watching the untouched tissue")
        self.context.board.rest_calibrated = True
        for name, found in calibration.items():
            self.context.board.tell("start", f"Monitoring is calibrated, {name}: {found}.")
        return self.succeed(Code.CALIBRATED, "monitoring knows the untouched tissue")


@register_node
class Wait(Task):
    """Hold still for a while; succeeds when the time is over."""

    Parameters = WaitParameters
    parameters: WaitParameters

    def initialise(self) -> None:
        self._started_s = self.context.board.watched_s

    def update(self) -> Status:
        waited_s = self.context.board.watched_s - self._started_s
        if waited_s < self.parameters.seconds:
            return self.run(Code.WAITING, f"holding still: {waited_s:.1f} s")
        return self.succeed(Code.WAITED, f"held still for {waited_s:.1f} s")


@register_node
class Finish(Task):
    """End the operation where enough of the region is seen; fail where it is not, or unknown."""

    def update(self) -> Status:
        board = self.context.board
        seen, wanted = board.visible_share, self.context.scene.thresholds.roi_visibility
        if seen is None or seen < wanted:
            share = "unknown" if seen is None else f"{seen:.0%}"
            return self.fail(
                Code.HIDDEN,
                f"not at the goal: {share} of the region is visible of {wanted:.0%} wanted",
            )
        sentence = f"{seen:.0%} of the region of interest is visible: the goal is reached."
        board.tell("goal", sentence)
        board.end("goal", sentence, Code.GOAL)
        return self.succeed(Code.GOAL, sentence)


@register_node
class AskHuman(Task):
    """Stop, keep the grip, and ask a human to take over."""

    answers: ClassVar[frozenset[Status]] = frozenset({Status.SUCCESS})

    def update(self) -> Status:
        board, why = self.context.board, self._why()
        sentence = f"Motion stopped, a human is asked to take over: {why.message}."
        board.tell("human", sentence, "error")
        board.end("human", why.message, why.code)
        return self.succeed(Code.ASKED, why.message)

    def _why(self) -> Cause:
        board = self.context.board
        operator = board.inputs.operator
        if operator.forbids is not None:
            return Cause(HOLDING_CODES.get(operator.mode, Code.STOPPED), operator.forbids)
        if board.operator_refused:
            return Cause(Code.PLAN_REFUSED, board.operator_refused)
        if board.inputs.missing:
            return Cause(Code.STALE, "; ".join(board.inputs.missing))
        if board.mismatch is not None and board.mismatch.cause == "arm":
            return Cause(Code.BLAMED, board.mismatch.sentence)
        if (board.warning_state or 0) >= 2:
            off_mm = board.mu_m * 1e3
            why = f"the tissue is {off_mm:.1f} mm away from where the model expects it"
            return Cause(Code.WARNED, why)
        dead_end = "no safe way to go on was found"
        if board.failure is not None:
            return Cause(board.failure.code, f"{dead_end}: {board.failure.message}")
        return Cause(Code.ASKED, dead_end)


@register_node
class HumanHelps(Node):
    """Succeeds if a human can help with what stopped the operation, and nothing else did."""

    role: ClassVar[Role] = "guard"

    def update(self) -> Status:
        failure = self.context.board.failure
        if failure is None:
            return self.fail(Code.WOULD_NOT_HELP, "nothing failed that a human could help with")
        if not helps(Remedy.HUMAN, failure.code):
            return self.fail(
                Code.WOULD_NOT_HELP, f"a human does not help against this: {failure.message}"
            )
        return self.succeed(Code.HUMAN_HELPS, f"a human can help: {failure.message}")


@register_node
class GiveUp(Task):
    """End the operation without having reached the goal."""

    def update(self) -> Status:
        board = self.context.board
        why = board.no_plan or "no plan leads to the goal any more"
        board.tell("end", f"The goal was not reached: {why}", "error")
        board.end("not_reached", why, Code.IMPOSSIBLE if board.no_plan else Code.GAVE_UP)
        return self.succeed(Code.GAVE_UP, why)
