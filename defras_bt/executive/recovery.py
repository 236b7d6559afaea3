"""Base class of the leaves that repair what stopped the motion."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

from py_trees.common import Status

from defras_bt.executive.node import Node, Role
from defras_bt.executive.reasons import Code, Remedy, helps


class RecoveryLeaf(Node):
    """A leaf that runs only where the failure's code says that it may help.

    A subclass sets ``remedy`` and implements :meth:`recover`. What it cannot mend becomes the
    failure that those after it are asked about: a plan that was refused asks for a human, not for
    the next planner. Where nothing failed in this tick it runs as any other leaf.
    """

    role: ClassVar[Role] = "recovery"
    remedy: ClassVar[Remedy]

    @abstractmethod
    def recover(self) -> Status:
        """What ``update()`` is to other leaves."""

    def update(self) -> Status:
        board = self.context.board
        failure = board.failure
        if failure is not None and not helps(self.remedy, failure.code):
            return self.fail(
                Code.WOULD_NOT_HELP,
                f"{self.remedy.spoken} does not help against this: {failure.message}",
            )
        status = self.recover()
        if status == Status.FAILURE:
            board.failure = self.cause
        return status
