"""What every node of a tree did in a tick and why, also those that a guard pre-empted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.blackboard import Blackboard
from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.loader import LoadedTree, walk
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


class _Word(NamedTuple):
    """What one node said when it was ticked; ``leaf`` is the one that the words come from.

    ``name`` is that of ``status``: to ask an enumeration for it takes longer than all else.
    """

    status: Status
    name: str
    code: str
    message: str
    decider: Behaviour | None
    leaf: Behaviour


class _Words:
    """The last words of every node of a tree by path, brought up to date tick by tick."""

    def __init__(self, paths: Mapping[Behaviour, str], ever: Mapping[Behaviour, _Word]) -> None:
        self.paths = paths
        self._silence = dict.fromkeys(paths.values(), "")
        self._last_status: dict[str, str] = {}
        self._code: dict[str, str] = {}
        self._message = dict(self._silence)
        self._decider: dict[str, str] = {}
        self._take(ever)

    def snapshot(
        self,
        now: Mapping[Behaviour, _Word],
        new: Mapping[Behaviour, _Word],
        cause: Cause | None,
        stopped_by: Cause | None,
    ) -> TreeSnapshot:
        """What stands after a tick in which the nodes of ``now`` spoke, those of ``new`` anew."""
        self._take(new)
        paths = self.paths
        spoken = {paths[node]: word.name for node, word in now.items() if node in paths}
        return TreeSnapshot(
            status=self._silence | spoken,
            last_status=dict(self._last_status),
            code=dict(self._code),
            message=dict(self._message),
            decider=dict(self._decider),
            cause=cause,
            stopped_by=stopped_by,
        )

    def _take(self, words: Mapping[Behaviour, _Word]) -> None:
        for node, (_, name, code, message, decider, _) in words.items():
            path = self.paths.get(node)
            if path is None:
                continue
            self._last_status[path] = name
            self._code[path] = code
            self._message[path] = message
            by = self.paths.get(decider) if decider is not None else None
            if by is None:
                self._decider.pop(path, None)
            else:
                self._decider[path] = by


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
        self._now: dict[Behaviour, _Word] = {}
        self._new: dict[Behaviour, _Word] = {}
        self._ever: dict[Behaviour, _Word] = {}
        self._plan: list[Behaviour] | None = None
        self._words = _Words({}, {})

    def initialise(self) -> None:
        self._now, self._new = {}, {}

    def run(self, behaviour: Behaviour) -> None:
        word = self._now[behaviour] = self._word(behaviour)
        if word is not self._ever.get(behaviour):
            self._new[behaviour] = self._ever[behaviour] = word
        if behaviour is self._carries_out and word.status == Status.FAILURE:
            self._board.failure = Cause(word.code, word.message)

    def snapshot(self) -> TreeSnapshot:
        """The tick that just ended."""
        slot = self._tree.plan_slot
        plan = [] if slot is None else list(slot.children)
        if plan != self._plan:
            # Only filling and emptying the slot changes the tree.
            self._plan = plan
            paths = dict(walk(self._tree.root))
            self._ever = {node: word for node, word in self._ever.items() if node in paths}
            self._words = _Words(paths, self._ever)
        stop = self._now.get(self._carries_out) if self._carries_out is not None else None
        stopped = stop is not None and stop.status == Status.FAILURE
        return self._words.snapshot(
            self._now,
            self._new,
            self._cause(self._now.get(self._tree.root)),
            self._cause(stop) if stopped else None,
        )

    def _word(self, behaviour: Behaviour) -> _Word:
        """What a node just said; most often it says what it said before."""
        status = behaviour.status
        decider = deciding_child(behaviour, self._now) if behaviour.children else None
        if decider is not None:
            heard = self._now[decider]
            code, message, leaf = heard.code, heard.message, heard.leaf
        else:
            # Only leaves and the plan slot have words of their own. Asking for their class is slow.
            code, message = getattr(behaviour, "code", ""), behaviour.feedback_message
            leaf = behaviour
        before = self._ever.get(behaviour)
        if (
            before is not None
            and before.status is status
            and before.decider is decider
            and before.leaf is leaf
            and before.message == message
            and before.code == code
        ):
            return before
        return _Word(status, status.name, code, message, decider, leaf)

    def _cause(self, word: _Word | None) -> Cause | None:
        if word is None:
            return None
        return Cause(word.code, word.message, self._words.paths.get(word.leaf, ""))


def deciding_child(parent: Behaviour, heard: Mapping[Behaviour, _Word]) -> Behaviour | None:
    """The child that made ``parent``'s status what it is; None if none was ticked.

    Where one child was ticked, as under a decorator, it is that one. Otherwise it is the last one
    with the parent's status: the one that stopped a sequence or was chosen by a selector. Where all
    children of a selector failed, one that was not even tried decides nothing. Call it as soon as
    ``parent`` was ticked; ``heard`` has what was ticked in this tick.
    """
    status, same, ticked = parent.status, None, None
    for child in reversed(parent.children):
        word = heard.get(child)
        if word is None:
            continue
        if word.status == status:
            if word.code != Code.WOULD_NOT_HELP:
                return child
            same = same or child
        ticked = ticked or child
    return same or ticked


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
