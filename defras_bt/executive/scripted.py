"""A leaf that says what a script tells it, tick by tick, and touches nothing."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from py_trees.common import Status
from pydantic import Field, model_validator

from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.reasons import Code

StatusName = Literal["SUCCESS", "FAILURE", "RUNNING"]
_CODE = r"^[a-z][a-z0-9_]*$"
_MESSAGE = "as the script says"


class ScriptStep(NodeParameters):
    """What a scripted leaf says, and for how many ticks."""

    status: StatusName
    ticks: Annotated[int, Field(ge=1, description="How many ticks in a row.")] = 1
    code: Annotated[str, Field(pattern=_CODE, description="Reason for programs.")] = "scripted"
    message: Annotated[str, Field(min_length=1, description="Reason for people.")] = _MESSAGE


class Script(NodeParameters):
    """What a scripted leaf says, in one of two forms.

    ``steps``: step after step, whether or not the leaf was pre-empted meanwhile; the last one stays
    for ever. ``status`` with ``after_s``: RUNNING until so much world time has passed since the
    leaf was entered, then ``status``; entered again, it waits again.
    """

    steps: Annotated[tuple[ScriptStep, ...], Field(description="One after the other.")] = ()
    status: Annotated[StatusName | None, Field(description="The one thing it says.")] = None
    after_s: Annotated[float, Field(ge=0, description="World time before it says so.")] = 0.0
    code: Annotated[str, Field(pattern=_CODE, description="Reason for programs.")] = "scripted"
    message: Annotated[str, Field(min_length=1, description="Reason for people.")] = _MESSAGE

    @model_validator(mode="after")
    def _one_form(self) -> Script:
        if bool(self.steps) == (self.status is not None):
            raise ValueError("a script has either steps, or one status (perhaps with after_s)")
        for_status = {"after_s", "code", "message"} & self.model_fields_set
        if self.steps and for_status:
            raise ValueError(
                f"{', '.join(sorted(for_status))} belongs to a script with one status; "
                "with steps, write it into the steps"
            )
        return self

    @classmethod
    def of(cls, *statuses: StatusName) -> Script:
        """One step a tick.

        >>> [step.status for step in Script.of("RUNNING", "RUNNING", "FAILURE").steps]
        ['RUNNING', 'RUNNING', 'FAILURE']
        """
        return cls(steps=tuple(ScriptStep(status=status) for status in statuses))


class ScriptedLeaf(Node):
    """Says what its script tells it. It commands nothing and changes nothing on the blackboard."""

    role: ClassVar[Role] = "task"
    Parameters = Script
    parameters: Script

    _ticks = 0
    _entered_s = 0.0

    def initialise(self) -> None:
        if self.parameters.after_s:
            self._entered_s = self.context.board.inputs.time_s

    def update(self) -> Status:
        script = self.parameters
        if script.steps:
            step = self._step()
            self._ticks += 1
            return self._say(step.status, step.code, step.message)
        assert script.status is not None, "a script without steps has a status"
        if script.after_s and self._waited_s() < script.after_s:
            return self._say("RUNNING", "scripted", f"{script.status} after {script.after_s:g} s")
        return self._say(script.status, script.code, script.message)

    def _waited_s(self) -> float:
        # World times are multiples of a tick; a difference of two may miss one by rounding.
        return self.context.board.inputs.time_s - self._entered_s + 1e-9

    def _step(self) -> ScriptStep:
        before = 0
        for step in self.parameters.steps:
            before += step.ticks
            if self._ticks < before:
                return step
        return self.parameters.steps[-1]

    def _say(self, status: StatusName, code: str, message: str) -> Status:
        # A word of the project's own codes keeps its remedies, so that recoveries answer to it.
        known = next((own for own in Code if own == code), code)
        report = {"SUCCESS": self.succeed, "FAILURE": self.fail, "RUNNING": self.run}[status]
        return report(known, message)
