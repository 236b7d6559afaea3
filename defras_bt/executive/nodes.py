"""Leaves that pace, pause and end an operation."""

from __future__ import annotations

from typing import Annotated, ClassVar

from py_trees.common import Status
from pydantic import Field

from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.registry import register_node


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
        if board.inputs.force_n > board.inputs.force_threshold_n:
            reasons.append(f"{board.inputs.force_n:.2f} N")
        if not reasons:
            return self.succeed("nominal", "full speed")
        board.rate = self.parameters.slow
        return self.succeed("slowed", f"slowed to {board.rate:.0%}: {', '.join(reasons)}")


@register_node
class CalibrateRest(Task):
    """Watch the untouched tissue until monitoring knows its noise."""

    def update(self) -> Status:
        calibration = self.context.monitor.calibration
        if not calibration:
            return self.run("watching", "watching the untouched tissue")
        self.context.board.rest_calibrated = True
        for name, found in calibration.items():
            self.context.board.tell("start", f"Monitoring is calibrated, {name}: {found}.")
        return self.succeed("calibrated", "monitoring knows the untouched tissue")


@register_node
class Wait(Task):
    """Hold still for a while; succeeds when the time is over."""

    Parameters = WaitParameters
    parameters: WaitParameters

    def initialise(self) -> None:
        self._started_s = self.context.board.inputs.time_s

    def update(self) -> Status:
        waited_s = self.context.board.inputs.time_s - self._started_s
        if waited_s < self.parameters.seconds:
            return self.run("waiting", f"holding still: {waited_s:.1f} s")
        return self.succeed("waited", f"held still for {waited_s:.1f} s")


@register_node
class Finish(Task):
    """End the operation: the goal is reached."""

    def update(self) -> Status:
        board = self.context.board
        seen = board.inputs.observation.roi_visibility or 0.0
        sentence = f"{seen:.0%} of the region of interest is visible: the goal is reached."
        board.tell("goal", sentence)
        board.end("goal", sentence)
        return self.succeed("goal", sentence)


@register_node
class AskHuman(Task):
    """Stop, keep the grip, and ask a human to take over."""

    def update(self) -> Status:
        board = self.context.board
        why = self._why()
        board.tell("human", f"Motion stopped, a human is asked to take over: {why}.", "error")
        board.end("human", why)
        return self.succeed("asked", why)

    def _why(self) -> str:
        board = self.context.board
        if board.inputs.operator_stop or board.operator_refused:
            return board.inputs.operator_stop or str(board.operator_refused)
        if board.inputs.missing:
            return "; ".join(board.inputs.missing)
        if (board.warning_state or 0) >= 2:
            return f"the tissue is {board.mu_m * 1e3:.1f} mm away from where the model expects it"
        return "no safe way to go on was found"


@register_node
class GiveUp(Task):
    """End the operation without having reached the goal."""

    def update(self) -> Status:
        board = self.context.board
        why = board.no_plan or board.operator_refused or "no plan leads to the goal any more"
        board.tell("end", f"The goal was not reached: {why}", "error")
        board.end("not_reached", why)
        return self.succeed("gave_up", why)
