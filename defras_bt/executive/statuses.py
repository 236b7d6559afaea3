"""What every node of a tree did in a tick, also those that a guard pre-empted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.loader import LoadedTree


@dataclass(frozen=True)
class TreeSnapshot:
    """Status ("" where a node was not ticked) and last message per path."""

    status: Mapping[str, str]
    message: Mapping[str, str]


class TickedVisitor(py_trees.visitors.VisitorBase):
    """Collects which behaviours were ticked. py_trees' own snapshot misses pre-empted ones."""

    def __init__(self) -> None:
        super().__init__(full=False)
        self._ticked: dict[object, Status] = {}

    def initialise(self) -> None:
        self._ticked = {}

    def run(self, behaviour: Behaviour) -> None:
        self._ticked[behaviour.id] = behaviour.status

    def snapshot(self, tree: LoadedTree) -> TreeSnapshot:
        """The tick that just ended, by path."""
        status, message = {}, {}
        words = {b.id: b.feedback_message for b in tree.root.iterate()}
        for identifier, path in tree.paths().items():
            ticked = self._ticked.get(identifier)
            known = ticked is not None and ticked != Status.INVALID
            status[path] = ticked.name if ticked is not None and known else ""
            message[path] = words[identifier]
        return TreeSnapshot(status, message)
