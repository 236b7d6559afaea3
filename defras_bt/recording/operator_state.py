"""What the operator wants, as the tree is told at each tick and as it is recorded."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from defras_bt.planning.plan import Plan


class Mode(StrEnum):
    """Who decides about motion. Nothing moves but in ``autonomous``."""

    AUTONOMOUS = "autonomous"
    PAUSED = "paused"
    TAKEN_OVER = "taken_over"
    STOPPED = "stopped"


class Act(StrEnum):
    """What an operator can ask for."""

    PAUSE = "pause"
    RESUME = "resume"
    STOP = "stop"
    TAKE_OVER = "take_over"
    HAND_BACK = "hand_back"
    APPROVE = "approve"
    REFUSE = "refuse"

    @property
    def spoken(self) -> str:
        """As one says it: "hand back"."""
        return self.value.replace("_", " ")


@dataclass(frozen=True)
class DoneAct:
    """An act that took effect. ``source``: the front end; ``words``: what the operator added."""

    act: Act
    source: str
    words: str = ""


@dataclass(frozen=True)
class OperatorState:
    """``reason`` says in words why nothing moves; "" while the executive decides.

    ``acts`` took effect since the tick before.
    """

    mode: Mode = Mode.AUTONOMOUS
    reason: str = ""
    acts: tuple[DoneAct, ...] = ()

    @property
    def forbids(self) -> str | None:
        """Why nothing may move, in words; None while it may."""
        return None if self.mode is Mode.AUTONOMOUS else self.reason

    @property
    def holds(self) -> bool:
        """Whether the operation stands still until the operator lets it go on."""
        return self.mode in (Mode.PAUSED, Mode.TAKEN_OVER)


NOBODY = OperatorState()
"""No operator is there, or none wants anything."""


class Operator(Protocol):
    """Where the executive hears of the operator."""

    def state(self) -> OperatorState:
        """What the operator wants now; asked once a tick."""

    def approve(self, plan: Plan) -> bool | None:
        """Whether ``plan`` may be carried out; None until that was answered, ask again then."""

    def idle(self) -> None:
        """Let time pass while the operator is being waited for; returns at once otherwise."""


class Unattended:
    """Nobody watches; every plan may be carried out."""

    def state(self) -> OperatorState:
        return NOBODY

    def approve(self, plan: Plan) -> bool | None:
        return True

    def idle(self) -> None:
        pass


UNATTENDED = Unattended()
