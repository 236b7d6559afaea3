"""Tree files turned into py_trees behaviours that can be ticked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import UUID

from py_trees.behaviour import Behaviour

from defras_bt.executive.composites import PlanSlot
from defras_bt.executive.registry import NODES, Registry
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_kinds import KINDS, kind_of
from defras_bt.executive.tree_spec import MetricName, NodeSpec, TreeSpec
from defras_sim.yaml_source import Fault, InvalidFile

if TYPE_CHECKING:
    from defras_bt.executive.context import Context


@dataclass(frozen=True)
class LoadedTree:
    """A tree ready to be ticked. ``plan_slot`` is None in a tree that carries out no plan."""

    name: str
    root: Behaviour
    plan_slot: PlanSlot | None
    metric: MetricName | None = None

    def paths(self) -> dict[UUID, str]:
        """Path of every behaviour now in the tree, by id, parents first.

        A path joins the names from the root: "defras/operate/act/force". Ask again after the plan
        slot was filled or cleared.
        """
        return {behaviour.id: path for behaviour, path in walk(self.root)}

    def kinds(self) -> tuple[tuple[str, str], ...]:
        """(path, kind) of every behaviour now in the tree; the kind of a leaf is its class name."""
        return tuple((path, kind_of(behaviour)) for behaviour, path in walk(self.root))


def load_tree(file: Path, context: Context, registry: Registry = NODES) -> LoadedTree:
    """Read a tree file and make its behaviours; every leaf is given ``context``.

    Raises:
        InvalidFile: with everything that is wrong with the file and those it includes, or with the
            ports that only a tree that includes this one can fill.
    """
    return build_tree(read_tree(file, registry), context)


def build_tree(tree: TreeSpec, context: Context) -> LoadedTree:
    """Make the behaviours of a tree that was read and checked, and give its ports their values.

    Raises:
        InvalidFile: the tree needs values that only a tree that includes it can give.
    """
    if tree.needs:
        raise InvalidFile(
            Fault(*place, f"port {key!r} has no value: this tree can only be included by another")
            for key, place in tree.needs.items()
        )
    for key, value in tree.values.items():
        context.board.ports.write(key, value)
    root = _build(tree.root, context)
    slots = [behaviour for behaviour, _ in walk(root) if isinstance(behaviour, PlanSlot)]
    return LoadedTree(tree.name, root, slots[0] if slots else None, tree.metric)


def walk(root: Behaviour, above: str = "") -> Iterator[tuple[Behaviour, str]]:
    """Every behaviour under and including ``root`` with its path, parents before children."""
    path = f"{above}{root.name}"
    yield root, path
    for child in root.children:
        yield from walk(child, f"{path}/")


def _build(spec: NodeSpec, context: Context) -> Behaviour:
    if spec.node_class is not None:
        leaf = spec.node_class(spec.name, context, spec.options)
        leaf.keys = {**leaf.keys, **spec.keys}
        return leaf
    children = [_build(child, context) for child in spec.children]
    return KINDS[spec.kind].build(spec.name, spec.options, children)
