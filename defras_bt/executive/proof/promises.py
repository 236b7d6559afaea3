"""What leaves promise about their answers, so that the proof may count on it.

Without a promise a leaf may answer anything in any tick. Promises stand in the classes of the
leaves; a test keeps those of the built-in ones against the leaves themselves.
"""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.common import Status

from defras_bt.executive.dangers import WORLD
from defras_bt.executive.node import Node
from defras_bt.executive.proof.facts import LETTERS, Numbered


def promise(node: Numbered, variable: str, value: str) -> Status | None:
    """What a leaf surely answers where a variable of the world has this value; None: anything."""
    if node.spec is None or node.spec.node_class is None:
        return None
    return node.spec.node_class.promise(node.spec.options, variable, value)


def leaf_facts(root: Numbered) -> Iterator[str]:
    """What asp/tree_proof.lp asks for about the leaves."""
    for node in root.walk():
        if not node.is_leaf:
            continue
        # An action of a plan stands in no file; it may answer whatever any leaf may.
        leaf = Node if node.spec is None or node.spec.node_class is None else node.spec.node_class
        yield from (f"may({node.number},{LETTERS[status]})." for status in leaf.answers)
        if node.moves:
            yield f"moves({node.number})."
        if node.moves or leaf.opens_jaws:
            yield f"commands({node.number})."
        for variable, values in WORLD.items():
            for value in values:
                status = promise(node, variable, value)
                if status is not None:
                    letter = LETTERS[status]
                    yield f'promises({node.number},{variable},"{value}",{letter}).'
