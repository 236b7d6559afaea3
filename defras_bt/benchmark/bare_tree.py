"""The tree of a run as bare py_trees: the same inner nodes, leaves that say what was recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import py_trees
from py_trees import composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.loader import walk
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import NodeSpec
from defras_bt.planning.plan import Plan


class Said(NamedTuple):
    """What the nodes said in a tick, by path ("" where not ticked), and the plan in the tree."""

    node_status: Mapping[str, str]
    plan: Plan | None


class BareTree:
    """Ticks through what was ``said``; nobody listens, nothing is looked at.

    Each tick: :meth:`prepare`, :meth:`tick` (the one to measure), :meth:`check`.
    """

    def __init__(self, tree_file: Path, said: Sequence[Said]) -> None:
        self._said: Iterator[Said] = iter(said)
        root = bare(read_tree(tree_file).root, lambda spec: _Leaf(spec.name))
        self._bt = py_trees.trees.BehaviourTree(root)
        slots = [(node, path) for node, path in walk(root) if isinstance(node, PlanSlot)]
        self._slot: PlanSlot | None = slots[0][0] if slots else None
        self._slot_path = slots[0][1] if slots else ""
        self._plan: object = None
        self._status: Mapping[str, str] = {}

    def prepare(self) -> None:
        """Put the next tick's plan into the tree and its words into the leaves."""
        now = next(self._said)
        self._status = now.node_status
        if now.plan is not self._plan and self._slot is not None:
            self._plan = now.plan
            above = f"{self._slot_path}/"
            names = [p.removeprefix(above) for p in now.node_status if p.startswith(above)]
            self._slot.fill([_Leaf(name) for name in names])
        for node, path in walk(self._bt.root):
            if isinstance(node, _Leaf):
                said = self._status.get(path, "")
                node.says = Status[said] if said else Status.INVALID

    def tick(self) -> None:
        self._bt.tick()

    def check(self) -> None:
        """Whether the root came to what it had come to.

        Raises:
            RuntimeError: it did not, so that times could not be compared.
        """
        root = self._bt.root
        if root.status.name != self._status[root.name]:
            raise RuntimeError(
                f"the bare tree shows {root.status.name}, recorded is {self._status[root.name]}"
            )


class _Leaf(Behaviour):
    says = Status.INVALID

    def update(self) -> Status:
        return self.says


def bare(spec: NodeSpec, leaf: Callable[[NodeSpec], Behaviour]) -> Behaviour:
    """The tree of ``spec`` from py_trees' own inner nodes; ``leaf`` makes the leaves.

    A plan slot, which py_trees does not know, stays what it is.
    """
    if spec.node_class is not None:
        return leaf(spec)
    children = [bare(child, leaf) for child in spec.children]
    match spec.kind:
        case "reactive" | "sequence":
            return composites.Sequence(spec.name, spec.kind == "sequence", children)
        case "reactive_selector" | "selector":
            return composites.Selector(spec.name, spec.kind == "selector", children)
        case "invert":
            return decorators.Inverter(spec.name, children[0])
        case "ignore_failure":
            return decorators.FailureIsSuccess(spec.name, children[0])
    return KINDS[spec.kind].build(spec.name, spec.options, children)
