"""Base class of every leaf of a behaviour tree."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import py_trees
from py_trees.common import Status
from pydantic import BaseModel, ConfigDict

from defras_bt.executive.ports import PortUnset, Writes, ports_of
from defras_bt.recording.record import Cause

if TYPE_CHECKING:
    from defras_bt.executive.context import Context

Role = Literal["guard", "motion", "recovery", "task"]
"""What a leaf is for.

guard: says whether motion may go on; answers at once and fails closed. motion: proposes a command
for an arm. recovery: repairs what made a guard trip. task: everything else.
"""

_CODE = re.compile(r"[a-z][a-z0-9_]*")


class NodeParameters(BaseModel):
    """What a tree file may say about a leaf: unknown keys, infinities and NaN are faults."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class NoParameters(NodeParameters):
    """Parameters of a leaf that has none."""


class UnreportedStatus(RuntimeError):
    """A leaf ended its tick with a status that it gave no code and message for."""


class Node(py_trees.behaviour.Behaviour):
    """A leaf that always says why: every status comes with a code and a message.

    A subclass sets ``role`` and, where it has any, ``Parameters``; it implements ``update()`` and
    ends every way through it with :meth:`succeed`, :meth:`fail` or :meth:`run`. ``initialise()`` is
    called on the first tick of each new activity; ``terminate()`` when the activity ends, also when
    a guard pre-empts it. ``terminate()`` must never command motion: a pre-empted action is
    terminated *after* the branch that took over was ticked, so it would have the last word.

    What a proof about a tree may count on is declared, too: ``answers``, all that ``update()`` ever
    reports; ``opens_jaws``, for a leaf that commands jaws although it is no motion; and
    :meth:`promise`.

    Values that leaves hand to each other are ports (ports.py), declared as class attributes.

    Attributes:
        keys: under which key of the blackboard each port stands; a tree file may choose others
            than the names of the ports.
        code: reason of the last status, for counting and recovery: a member of
            :class:`~defras_bt.executive.reasons.Code`, or of a package's own ``ReasonCode``.
        feedback_message: the same for people, with numbers and units.
        reported_status: the last status given by ``update()``. Pre-emption resets ``status`` to
            INVALID; this, the code and the message stay, so that a recorder can still tell.
    """

    role: ClassVar[Role]
    Parameters: ClassVar[type[BaseModel]] = NoParameters
    answers: ClassVar[frozenset[Status]] = frozenset(
        {Status.SUCCESS, Status.FAILURE, Status.RUNNING}
    )
    opens_jaws: ClassVar[bool] = False
    status: Status

    @classmethod
    def promise(cls, parameters: Any, variable: str, value: str) -> Status | None:
        """What a leaf with these parameters surely answers in a tick; None: anything.

        ``variable`` has ``value`` in that tick; :data:`~defras_bt.executive.dangers.WORLD` lists
        them. A guard that promises FAILURE in a danger is one that a tree can be proved with.
        """
        return None

    def __init__(self, name: str, context: Context, parameters: BaseModel) -> None:
        super().__init__(name)
        self.context = context
        self.parameters = parameters
        ports = ports_of(type(self))
        self.keys: Mapping[str, str] = {port: port for port in ports}
        self._writes = tuple(port for port in ports.values() if isinstance(port, Writes))
        self._answers = tuple(self.answers)
        self.code = ""
        self.reported_status = Status.INVALID
        self._reported = False

    @property
    def cause(self) -> Cause:
        """Code and message of the last status."""
        return Cause(self.code, self.feedback_message)

    def succeed(self, code: str, message: str) -> Status:
        """Report SUCCESS: done, or (guard) motion may go on.

        Raises:
            PortUnset: nothing was ever written to one of the ports that the leaf writes.
        """
        for port in self._writes:
            if self.keys[port.name] not in self.context.board.ports:
                raise PortUnset(
                    f"{type(self).__name__} {self.name!r} succeeds without having written its "
                    f"port {port.name!r}, on which other leaves count"
                )
        return self._report(Status.SUCCESS, code, message)

    def fail(self, code: str, message: str) -> Status:
        """Report FAILURE: not possible, or (guard) motion must stop."""
        return self._report(Status.FAILURE, code, message)

    def run(self, code: str, message: str) -> Status:
        """Report RUNNING: under way, tick again."""
        return self._report(Status.RUNNING, code, message)

    def tick(self) -> Iterator[py_trees.behaviour.Behaviour]:
        """Tick as py_trees does, and refuse a status that ``update()`` did not report.

        Its own tick writes to a log that nobody reads, which takes most of its time.

        Raises:
            UnreportedStatus: ``update()`` returned without succeed(), fail() or run().
        """
        self._reported = False
        if self.status != Status.RUNNING:
            self.initialise()
        status = self.update()
        if not self._reported or status != self.reported_status:
            raise UnreportedStatus(
                f"{type(self).__name__} {self.name!r} returned {status} without a reason; "
                "end update() with return self.succeed(...), self.fail(...) or self.run(...)"
            )
        if status != Status.RUNNING:
            self.stop(status)
        self.status = status
        yield self

    def stop(self, new_status: Status) -> None:
        """End the current activity; as py_trees does it, without its log."""
        self.terminate(new_status)
        self.status = new_status

    def _report(self, status: Status, code: str, message: str) -> Status:
        if not (code and code is self.code) and not _CODE.fullmatch(code):
            raise ValueError(f"{type(self).__name__}: code {code!r} should be snake_case")
        if not message:
            raise ValueError(f"{type(self).__name__}: code {code!r} needs a message for people")
        if status not in self._answers:
            known = ", ".join(sorted(answer.name for answer in self.answers))
            raise ValueError(
                f"{type(self).__name__}: code {code!r} comes with {status.name}, but its "
                f"`answers` are {known}: trees were proved with those"
            )
        self.code, self.feedback_message = code, message
        self.reported_status, self._reported = status, True
        return status
