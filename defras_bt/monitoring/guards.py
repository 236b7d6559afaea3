"""Guards: leaves that say whether motion may go on. They are ticked every tick and fail closed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from py_trees.common import Status
from pydantic import Field

from defras_bt.executive.dangers import LONGEST_PATIENCE_S
from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.operator_nodes import HOLDING_CODES
from defras_bt.executive.reasons import Code
from defras_bt.executive.registry import register_node

if TYPE_CHECKING:
    from defras_bt.executive.context import Context


class Guard(Node):
    """Base of the guards."""

    role: ClassVar[Role] = "guard"


def _if(permitted: bool) -> Status:
    return Status.SUCCESS if permitted else Status.FAILURE


class StateParameters(NodeParameters):
    """A warning state, 0 to 3."""

    state: Annotated[int, Field(ge=1, le=3)]


class PatienceParameters(NodeParameters):
    """``patience_s``: how long the force may stay over its threshold at half speed."""

    patience_s: Annotated[float, Field(ge=0)] = 0.5


class ReadingsParameters(NodeParameters):
    """``readings``: in so many in a row enough has to be seen; one alone may be false."""

    readings: Annotated[int, Field(ge=1)] = 3


class TravelParameters(NodeParameters):
    """``travel_m``: motion of the tip after which there is something new to learn from."""

    travel_m: Annotated[float, Field(gt=0)] = 0.005


@register_node
class SensorsFresh(Guard):
    """Succeeds if every reading is there, a number, and young enough."""

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        return _if(value == "fresh") if variable == "readings" else None

    def update(self) -> Status:
        missing = self.context.board.inputs.missing
        if missing:
            return self.fail(Code.STALE, "; ".join(missing))
        return self.succeed(Code.FRESH, "all readings are fresh")


@register_node
class OperatorPermits(Guard):
    """Succeeds unless the operator stopped, paused or took over, or refused a plan."""

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        return Status.FAILURE if variable == "operator" and value != "permits" else None

    def update(self) -> Status:
        board = self.context.board
        operator = board.inputs.operator
        if operator.forbids is not None:
            return self.fail(HOLDING_CODES.get(operator.mode, Code.STOPPED), operator.forbids)
        if board.operator_refused:
            return self.fail(Code.PLAN_REFUSED, board.operator_refused)
        return self.succeed(Code.PERMITTED, "the operator permits motion")


@register_node
class WarningBelow(Guard):
    """Succeeds while the warning state is below ``state``; an unknown state is too high."""

    Parameters = StateParameters
    parameters: StateParameters

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        if variable != "warning":
            return None
        return _if(value != "unknown" and int(value) < parameters.state)

    def update(self) -> Status:
        state = self.context.board.warning_state
        if state is None:
            return self.fail(Code.WARNING_UNKNOWN, "the warning state is unknown")
        if state >= self.parameters.state:
            return self.fail(Code.WARNED, f"the warning state is {state}")
        return self.succeed(Code.BELOW, f"the warning state is {state}")


@register_node
class WarningReached(Guard):
    """Succeeds if the warning state is known to be ``state`` or higher."""

    Parameters = StateParameters
    parameters: StateParameters

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        if variable != "warning":
            return None
        return _if(value != "unknown" and int(value) >= parameters.state)

    def update(self) -> Status:
        state = self.context.board.warning_state
        if state is None or state < self.parameters.state:
            return self.fail(
                Code.BELOW, f"the warning state is {'unknown' if state is None else state}"
            )
        return self.succeed(Code.REACHED, f"the warning state is {state}")


@register_node
class ForceAccepted(Guard):
    """Succeeds unless the estimated force stayed over its threshold, or is unknown, too long."""

    Parameters = PatienceParameters
    parameters: PatienceParameters

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        notices = parameters.patience_s <= LONGEST_PATIENCE_S
        return Status.FAILURE if (variable, value) == ("force", "dangerous") and notices else None

    def update(self) -> Status:
        board = self.context.board
        force_n, limit_n = board.inputs.force_n, board.inputs.force_threshold_n
        if np.isnan(force_n):
            return self.fail(Code.FORCE_UNKNOWN, "the force is unknown")
        if np.isnan(limit_n):
            return self.fail(Code.FORCE_UNKNOWN, "the threshold of the force is not a number")
        if board.force_over_s >= self.parameters.patience_s:
            return self.fail(
                Code.FORCE_TOO_HIGH,
                f"the force is {force_n:.2f} N, over its threshold of {limit_n:.2f} N "
                f"for {board.force_over_s:.2f} s",
            )
        return self.succeed(
            Code.ACCEPTED, f"the force is {force_n:.2f} N of at most {limit_n:.2f} N"
        )


@register_node
class RegionVisible(Guard):
    """Succeeds if enough of the region of interest is seen, in several readings in a row.

    A tick in which it was not asked interrupts the row: nobody knows what was seen then.
    """

    Parameters = ReadingsParameters
    parameters: ReadingsParameters

    def __init__(self, name: str, context: Context, parameters: ReadingsParameters) -> None:
        super().__init__(name, context, parameters)
        self._row = 0
        self._stamp_s: float | None = None
        self._tick: int | None = None

    def update(self) -> Status:
        inputs = self.context.board.inputs
        seen = self.context.board.visible_share
        wanted = self.context.scene.thresholds.roi_visibility
        missed = self._tick is None or inputs.tick > self._tick + 1
        self._tick = inputs.tick
        if seen is None or seen < wanted:
            self._row, self._stamp_s = 0, None
            share = "unknown" if seen is None else f"{seen:.0%}"
            return self.fail(
                Code.HIDDEN, f"{share} of the region is visible of {wanted:.0%} wanted"
            )
        stamp_s = inputs.observation.roi_visibility_stamp_s
        if missed:
            self._row = 1
        elif stamp_s != self._stamp_s:
            self._row += 1
        self._stamp_s = stamp_s
        if self._row < self.parameters.readings:
            return self.fail(
                Code.HIDDEN,
                f"{seen:.0%} of the region is visible, so far in {self._row} of "
                f"{self.parameters.readings} readings in a row",
            )
        return self.succeed(Code.VISIBLE, f"{seen:.0%} of the region is visible")


@register_node
class RestCalibrated(Guard):
    """Succeeds once monitoring knows what no discrepancy looks like."""

    def update(self) -> Status:
        if self.context.board.rest_calibrated:
            return self.succeed(Code.CALIBRATED, "monitoring knows the untouched tissue")
        return self.fail(Code.NOT_CALIBRATED, "monitoring does not know the untouched tissue yet")


@register_node
class LearningDue(Guard):
    """Succeeds if there is something new to learn from since the last attempt."""

    Parameters = TravelParameters
    parameters: TravelParameters

    def update(self) -> Status:
        board = self.context.board
        if not board.grips:
            return self.fail(Code.NOTHING_HELD, "nothing is held: the shape says nothing new")
        state = board.warning_state
        last = board.last_learning
        if last is None or (state is not None and state > last.warning_state):
            return self.succeed(Code.DUE, "not tried at this warning state yet")
        travel_m = max(
            float(np.linalg.norm(arm.tissue_from_tip.position_m - last.tips_m[name]))
            for name, arm in board.inputs.observation.arms.items()
        )
        if travel_m >= self.parameters.travel_m:
            return self.succeed(Code.DUE, f"moved {travel_m * 1e3:.1f} mm since the last attempt")
        return self.fail(Code.NOT_DUE, f"moved only {travel_m * 1e3:.1f} mm since the last attempt")
