"""A tree as facts for asp/tree_semantics.lp."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from py_trees.common import Status

from defras_bt.executive.tree_decorators import (
    DECORATORS,
    OnceOptions,
    decorator_shows,
)
from defras_bt.executive.tree_kinds import ParallelOptions
from defras_bt.executive.tree_spec import NodeSpec

LETTERS = {
    Status.INVALID: "i",
    Status.RUNNING: "r",
    Status.SUCCESS: "s",
    Status.FAILURE: "f",
}
"""How the programs write a status."""

STATUSES = {letter: status for status, letter in LETTERS.items()}


@dataclass(frozen=True)
class Numbered:
    """A node with its number, which grows in the order in which nodes are ticked.

    ``spec`` is None for an action of a plan, which stands in no file.
    """

    number: int
    path: str
    spec: NodeSpec | None
    children: tuple[Numbered, ...]

    def walk(self) -> Iterator[Numbered]:
        """This node and everything under it, parents before children."""
        yield self
        for child in self.children:
            yield from child.walk()

    @property
    def is_slot(self) -> bool:
        return self.spec is not None and self.spec.kind == "plan_slot"

    @property
    def is_leaf(self) -> bool:
        return self.spec is None or self.spec.node_class is not None

    @property
    def moves(self) -> bool:
        """Whether it commands motion when it is ticked."""
        if self.spec is None:
            return True
        return self.spec.node_class is not None and self.spec.node_class.role == "motion"


def numbered(root: NodeSpec, plan_length: int = 0, first: int = 0) -> Numbered:
    """The tree under ``root`` with ``plan_length`` actions in each plan slot.

    Numbers start at ``first`` and have no gaps.
    """
    return _Counter(plan_length, first).node(root, "")


class _Counter:
    def __init__(self, plan_length: int, first: int) -> None:
        self._plan_length = plan_length
        self._next = first

    def node(self, spec: NodeSpec, above: str) -> Numbered:
        number, path = self._number(), f"{above}{spec.name}"
        children = tuple(self.node(child, f"{path}/") for child in spec.children)
        if spec.kind == "plan_slot":
            names = (f"{path}/action {step}" for step in range(1, self._plan_length + 1))
            children = tuple(Numbered(self._number(), name, None, ()) for name in names)
        return Numbered(number, path, spec, children)

    def _number(self) -> int:
        self._next += 1
        return self._next - 1


def tree_facts(root: Numbered) -> Iterator[str]:
    """The facts that asp/tree_semantics.lp asks for about the tree itself."""
    yield f"root({root.number})."
    for node in root.walk():
        yield f"kind({node.number},{_kind(node)})."
        for index, child in enumerate(node.children, 1):
            yield f"child({node.number},{index},{child.number})."
        if node.spec is not None and node.spec.kind in DECORATORS:
            yield from _decorator_facts(node.number, node.spec)
        if node.spec is not None and isinstance(node.spec.options, ParallelOptions):
            yield from _parallel_facts(node, node.spec.options)


def _kind(node: Numbered) -> str:
    if node.spec is None or node.spec.node_class is not None:
        return "leaf"
    return "decorator" if node.spec.kind in DECORATORS else node.spec.kind


def _decorator_facts(number: int, spec: NodeSpec) -> Iterator[str]:
    kind = DECORATORS[spec.kind]
    for child, shown in decorator_shows(kind, spec.options).items():
        yield f"turns({number},{LETTERS[child]},{LETTERS[shown]})."
    if kind.counts is not None:
        yield f"counts({number},{LETTERS[kind.counts]})."
        yield f"limit({number},{getattr(spec.options, kind.limit)})."
    if isinstance(spec.options, OnceOptions):
        yield f"completes({number},s)."
        if spec.options.until == "completion":
            yield f"completes({number},f)."


def _parallel_facts(node: Numbered, options: ParallelOptions) -> Iterator[str]:
    wanted = options.succeed_when
    policy: Literal["all", "one", "selected"] = "selected" if isinstance(wanted, tuple) else wanted
    yield f"policy({node.number},{policy})."
    if options.synchronise:
        yield f"synchronised({node.number})."
    for child in node.children:
        if policy == "selected" and child.path.rpartition("/")[2] in wanted:
            yield f"selected({node.number},{child.number})."
