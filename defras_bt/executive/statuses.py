"""What every node of a tree did in a tick and why, also those that a guard pre-empted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from uuid import UUID

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.blackboard import Blackboard
from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.loader import LoadedTree
from defras_bt.executive.node import Node
from defras_bt.executive.reasons import Code
from defras_bt.recording.record import Cause


@dataclass(frozen=True)
class TreeSnapshot:
    """One tick, by path.

    ``status`` is "" where a node was not ticked; ``last_status`` is then still the last one it
    had, pre-empted or not. ``code`` and ``message`` are the node's last words; those of an inner
    node are its decider's. ``decider`` names the child whose status decided that of an inner node.
    ``cause``: the leaf at the end of the deciders from the root. ``stopped_by``: the same from the
    branch that carries out plans, where that failed.
    """

    status: Mapping[str, str]
    last_status: Mapping[str, str]
    code: Mapping[str, str]
    message: Mapping[str, str]
    decider: Mapping[str, str]
    cause: Cause | None
    stopped_by: Cause | None


@dataclass(frozen=True)
class _Word:
    """What one node said when it was ticked; ``leaf`` is the one that the words come from."""

    status: Status
    code: str
    message: str
    decider: UUID | None
    leaf: UUID


class TickedVisitor(py_trees.visitors.VisitorBase):
    """Hears every behaviour as it is ticked, before a later one pre-empts it.

    py_trees' own snapshot misses pre-empted behaviours. As soon as the branch that carries out
    plans has failed, its reason stands on the blackboard, for the recoveries of the same tick.
    """

    def __init__(self, board: Blackboard, tree: LoadedTree) -> None:
        super().__init__(full=False)
        self._board = board
        self._tree = tree
        self._carries_out = carries_out_plans(tree.plan_slot)
        self._now: dict[UUID, _Word] = {}
        self._ever: dict[UUID, _Word] = {}

    def initialise(self) -> None:
        self._now = {}

    def run(self, behaviour: Behaviour) -> None:
        word = self._word(behaviour)
        self._now[behaviour.id] = self._ever[behaviour.id] = word
        if behaviour is self._carries_out and word.status == Status.FAILURE:
            self._board.failure = Cause(word.code, word.message)

    def snapshot(self) -> TreeSnapshot:
        """The tick that just ended."""
        paths = self._tree.paths()
        self._ever = {id_: word for id_, word in self._ever.items() if id_ in paths}
        ever = {paths[id_]: word for id_, word in self._ever.items()}
        now = {path: self._now.get(id_) for id_, path in paths.items()}
        stop = self._now.get(self._carries_out.id) if self._carries_out is not None else None
        stopped = stop is not None and stop.status == Status.FAILURE
        return TreeSnapshot(
            status={path: word.status.name if word else "" for path, word in now.items()},
            last_status={path: word.status.name for path, word in ever.items()},
            code={path: word.code for path, word in ever.items()},
            message={path: ever[path].message if path in ever else "" for path in now},
            decider={
                path: paths[word.decider]
                for path, word in ever.items()
                if word.decider is not None and word.decider in paths
            },
            cause=self._cause(self._now.get(self._tree.root.id), paths),
            stopped_by=self._cause(stop, paths) if stopped else None,
        )

    def _word(self, behaviour: Behaviour) -> _Word:
        status = behaviour.status
        decider = deciding_child(behaviour, self._now)
        if decider is not None:
            heard = self._now[decider.id]
            return _Word(status, heard.code, heard.message, decider.id, heard.leaf)
        # Only leaves and the plan slot have words of their own.
        code = behaviour.code if isinstance(behaviour, Node | PlanSlot) else ""
        return _Word(status, code, behaviour.feedback_message, None, behaviour.id)

    @staticmethod
    def _cause(word: _Word | None, paths: Mapping[UUID, str]) -> Cause | None:
        return Cause(word.code, word.message, paths.get(word.leaf, "")) if word else None


def deciding_child(parent: Behaviour, heard: Mapping[UUID, _Word]) -> Behaviour | None:
    """The child that made ``parent``'s status what it is; None if none was ticked.

    Of a decorator it is what it decorates. Otherwise it is the last ticked child with the parent's
    status: the one that stopped a sequence or was chosen by a selector. Where all children of a
    selector failed, one that was not even tried decides nothing. Call it as soon as ``parent`` was
    ticked; ``heard`` has what was ticked in this tick, by id.
    """
    ticked = [child for child in parent.children if child.id in heard]
    if isinstance(parent, py_trees.decorators.Decorator):
        return ticked[-1] if ticked else None
    same = [child for child in ticked if heard[child.id].status == parent.status]
    tried = [child for child in same if heard[child.id].code != Code.WOULD_NOT_HELP]
    candidates = tried or same or ticked
    return candidates[-1] if candidates else None


def carries_out_plans(slot: PlanSlot | None) -> Behaviour | None:
    """The branch around the plan slot whose failure means that motion stops.

    It is as large as can be without having alternatives to itself: those are the recoveries.
    """
    branch: Behaviour | None = slot
    while (
        branch is not None
        and branch.parent is not None
        and not isinstance(branch.parent, py_trees.composites.Selector)
    ):
        branch = branch.parent
    return branch
