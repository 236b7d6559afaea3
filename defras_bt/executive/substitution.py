"""Nodes of a tree replaced by scripted leaves, as a YAML file says, to try out what would happen.

A file lists which nodes, by path with wildcards, and what they say instead::

    # yaml-language-server: $schema=substitutes.schema.json
    substitutes:
      - {path: "**/force_accepted", status: FAILURE, code: force_too_high, after_s: 0}
      - path: "defras/operate/act/*_grasp_*"
        steps:
          - {status: RUNNING, ticks: 20}
          - {status: FAILURE, code: nothing_grasped, message: The jaw closed on nothing.}

Where several entries speak of a node the first one counts. A scripted leaf commands nothing, so a
substituted motion leaf moves nothing. The gate cannot be substituted: it goes on looking at the
readings themselves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from py_trees.behaviour import Behaviour
from py_trees.decorators import Decorator
from pydantic import Field, field_validator

from defras_bt.acting.actions import leaf_name
from defras_bt.executive.loader import LoadedTree, walk
from defras_bt.executive.node import NodeParameters
from defras_bt.executive.registry import did_you_mean
from defras_bt.executive.scripted import Script, ScriptedLeaf
from defras_bt.executive.tree_spec import Place, TreeSpec
from defras_bt.executive.wildcard import path_matches
from defras_bt.planning.plan import ACTIONS
from defras_sim.scene import ArmName
from defras_sim.yaml_source import Fault, InvalidFile, read_yaml

if TYPE_CHECKING:
    from defras_bt.executive.context import Context

_MOST_STEPS = 99
"""Longest plan of which a pattern may name an action."""


class Substitute(Script):
    """Which nodes, and what they say."""

    path: Annotated[str, Field(min_length=1, description="Path in the tree; *, ? and ** are wild.")]


class SubstitutesFile(NodeParameters):
    """Top level of a file of substitutes."""

    substitutes: tuple[Substitute, ...]

    @field_validator("substitutes")
    @classmethod
    def _something(cls, entries: tuple[Substitute, ...]) -> tuple[Substitute, ...]:
        if not entries:
            raise ValueError("list at least one node to replace, as {path: ..., status: SUCCESS}")
        return entries


@dataclass(frozen=True)
class Substitutes:
    """The entries of a file, each with its place. Empty: every node is its own."""

    entries: tuple[tuple[Substitute, Place], ...] = ()

    def script(self, path: str) -> Script | None:
        """What the node at ``path`` says instead; None if it is not substituted."""
        entry = next((e for e, _ in self.entries if path_matches(e.path, path)), None)
        if entry is None:
            return None
        return Script.model_validate(entry.model_dump(exclude={"path"}, exclude_unset=True))

    def paths(self, tree: TreeSpec) -> tuple[str, ...]:
        """Which nodes of ``tree`` are replaced; for actions of coming plans, their patterns.

        Raises:
            InvalidFile: an entry replaces nothing, or would leave no place for plans.
        """
        nodes = dict(tree.root.walk())
        slots = [path for path, node in nodes.items() if node.kind == "plan_slot"]
        faults: list[Fault] = []
        found: dict[str, int] = {}
        for index, (entry, place) in enumerate(self.entries):
            matches = [path for path in nodes if path_matches(entry.path, path)]
            actions = any(path_matches(entry.path, a) for slot in slots for a in _actions(slot))
            holding = [p for p in matches if any(f"{slot}/".startswith(f"{p}/") for slot in slots)]
            fresh = [path for path in matches if _replaced_by(path, found) is None]
            if holding:
                faults.append(Fault(*place, _holds_plan(entry.path, holding[0], slots[0])))
            elif fresh or actions:
                found |= dict.fromkeys(fresh or [entry.path], index)
            elif matches and (first := _replaced_by(matches[0], found)) is not None:
                _, (_, line, _) = self.entries[first]
                faults.append(
                    Fault(*place, f"{entry.path!r} replaces nothing that line {line} does not")
                )
            else:
                hint = did_you_mean(entry.path, tuple(nodes))
                faults.append(Fault(*place, f"no node has the path {entry.path!r}{hint}"))
        if faults:
            raise InvalidFile(faults)
        return tuple(found)

    def into_tree(self, tree: LoadedTree, context: Context) -> LoadedTree:
        """``tree`` with scripted leaves in place of its nodes; its plan slot stays the same."""
        if not self.entries:
            return tree
        return replace(tree, root=self._in_place_of(tree.root, tree.root.name, context))

    def into_plan(
        self, slot: Behaviour, root: Behaviour, leaves: Sequence[Behaviour], context: Context
    ) -> list[Behaviour]:
        """The actions of a plan about to be put into ``slot``, some of them scripted."""
        if not self.entries:
            return list(leaves)
        at = next(path for behaviour, path in walk(root) if behaviour is slot)
        return [self._in_place_of(leaf, f"{at}/{leaf.name}", context) for leaf in leaves]

    def _in_place_of(self, node: Behaviour, path: str, context: Context) -> Behaviour:
        script = self.script(path)
        if script is not None:
            return ScriptedLeaf(node.name, context, script)
        for child in list(node.children):
            other = self._in_place_of(child, f"{path}/{child.name}", context)
            if other is child:
                continue
            if isinstance(node, Decorator):
                node.children, node.decorated, other.parent = [other], other, node
            else:
                node.replace_child(child, other)
        return node


NOTHING_SUBSTITUTED = Substitutes()


def read_substitutes(file: Path) -> Substitutes:
    """Read a file of substitutes; whether they suit a tree is asked with :meth:`paths`.

    Raises:
        InvalidFile: with everything that is wrong with it.
    """
    source = read_yaml(file)
    entries = source.validate(SubstitutesFile).substitutes
    places = [source.fault(("substitutes", index, "path"), "") for index in range(len(entries))]
    return Substitutes(
        tuple(
            (entry, (place.file, place.line, place.column))
            for entry, place in zip(entries, places, strict=True)
        )
    )


def substitutes_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of a file of substitutes, for editors."""
    schema = SubstitutesFile.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _actions(slot: str) -> Iterator[str]:
    """The path of every action that a plan may bring into a slot."""
    for step in range(1, _MOST_STEPS + 1):
        for action in ACTIONS:
            for arm in get_args(ArmName):
                yield f"{slot}/{leaf_name(step, action, arm)}"


def _replaced_by(path: str, replaced: dict[str, int]) -> int | None:
    """Which entry replaced ``path``, or a node above it."""
    return next((i for other, i in replaced.items() if f"{path}/".startswith(f"{other}/")), None)


def _holds_plan(pattern: str, path: str, slot: str) -> str:
    return (
        f"{pattern!r} would replace {path}, where plans are carried out; to substitute their "
        f"actions, write a pattern like '{slot}/*_pull_*'"
    )
