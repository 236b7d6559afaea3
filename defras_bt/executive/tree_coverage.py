"""How much of a tree was seen at work: leaves that were ticked, answers that were given."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from py_trees.common import Status

from defras_bt.acting.actions import LEAVES
from defras_bt.executive.node import Node
from defras_bt.executive.tree_spec import NodeSpec, TreeSpec
from defras_bt.recording.coverage import Seen

_ORDER = (Status.SUCCESS, Status.FAILURE, Status.RUNNING)


@dataclass(frozen=True)
class LeafCoverage:
    """``seen``: how often each answer was given; ``possible``: those that the leaf can give.

    ``path`` of an action of plans ends in its name in asterisks, ``act/*_pull_*``: whatever step of
    whatever plan it was.
    """

    path: str
    seen: Mapping[str, int]
    possible: tuple[str, ...]

    @property
    def ticked(self) -> int:
        return sum(self.seen.values())

    @property
    def missing(self) -> tuple[str, ...]:
        """Answers that were never given."""
        return tuple(status for status in self.possible if not self.seen.get(status))

    def __str__(self) -> str:
        if not self.ticked:
            return "never ticked"
        given = ", ".join(f"{self.seen[s]} {s}" for s in self.possible if self.seen.get(s))
        return given + (f"; never {', '.join(self.missing)}" if self.missing else "")


@dataclass(frozen=True)
class TreeCoverage:
    """The leaves of a tree, in its order."""

    tree: str
    leaves: tuple[LeafCoverage, ...]

    @property
    def leaf_share(self) -> float:
        """Share of the leaves that were ticked."""
        return sum(leaf.ticked > 0 for leaf in self.leaves) / max(1, len(self.leaves))

    @property
    def branch_share(self) -> float:
        """Share of the answers that all leaves can give which were given."""
        possible = sum(len(leaf.possible) for leaf in self.leaves)
        missing = sum(len(leaf.missing) for leaf in self.leaves)
        return (possible - missing) / max(1, possible)


def tree_coverage(tree: TreeSpec, nodes: Mapping[str, Seen]) -> TreeCoverage:
    """What of ``tree`` stands in ``nodes`` (by path)."""
    return TreeCoverage(tree.name, tuple(_leaves(tree, nodes)))


def _leaves(tree: TreeSpec, nodes: Mapping[str, Seen]) -> Iterator[LeafCoverage]:
    for path, spec in tree.root.walk():
        if spec.kind == "plan_slot":
            yield from _actions(path, nodes)
        elif spec.node_class is not None:
            seen = nodes[path].statuses if path in nodes and _is(nodes[path], spec) else {}
            yield LeafCoverage(path, seen, _answers(spec.node_class))


def _actions(slot: str, nodes: Mapping[str, Seen]) -> Iterator[LeafCoverage]:
    for name, leaf in LEAVES.items():
        statuses: Counter[str] = Counter()
        for path, seen in nodes.items():
            above, _, last = path.rpartition("/")
            if above == slot and last.split("_")[1:2] == [name]:
                statuses.update(seen.statuses)
        yield LeafCoverage(f"{slot}/*_{name}_*", statuses, _answers(leaf))


def _is(seen: Seen, spec: NodeSpec) -> bool:
    """Whether what was seen is the node of the file and not another of its name."""
    return seen.kind in ("", spec.kind)


def _answers(leaf: type[Node]) -> tuple[str, ...]:
    at_once = leaf.role == "guard"
    return tuple(
        status.name
        for status in _ORDER
        if status in leaf.answers and not (at_once and status == Status.RUNNING)
    )
