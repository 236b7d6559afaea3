"""Whether an action was under way when a tick ended: only then may anything move."""

from __future__ import annotations

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status


class ActionVisitor(py_trees.visitors.VisitorBase):
    """Notes the leaves of role "motion" that were ticked.

    One that a guard pre-empts in the same tick is INVALID when the tick ends. What it commanded
    before, or commands as it is terminated, is nobody's motion.
    """

    def __init__(self) -> None:
        super().__init__(full=False)
        self._ticked: list[Behaviour] = []

    def initialise(self) -> None:
        self._ticked = []

    def run(self, behaviour: Behaviour) -> None:
        # Only leaves have a role. Asking for their class is slow.
        if getattr(behaviour, "role", None) == "motion":
            self._ticked.append(behaviour)

    @property
    def acting(self) -> bool:
        """Whether one of them still stands by its motion: it goes on, or has just finished."""
        return any(leaf.status in (Status.RUNNING, Status.SUCCESS) for leaf in self._ticked)
