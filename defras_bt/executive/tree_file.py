"""Behaviour trees in YAML: read, included, named and checked, with every fault at its place.

A file has a name, a description and a tree. A node is its kind, alone or with what it needs::

    name: defras
    tree:
      reactive:
        children:
          - ForceBelowLimit
          - CloudIsFresh: {name: cloud, limit_s: 0.3}
          - retry: {attempts: 3, child: Replan}
          - subtree: {file: recover.yaml}
          - plan_slot: {name: act}

Kinds in snake_case are inner nodes (tree_kinds.py), kinds in CamelCase registered leaves. A node is
called by its kind unless it has a name; the topmost node of a file is called by the file's name.
Names joined from the root are paths ("defras/act"), so siblings have different ones.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from defras_bt.executive.ports import ports_of
from defras_bt.executive.registry import NODES, Registry, did_you_mean, snake_case
from defras_bt.executive.tree_check import check_tree
from defras_bt.executive.tree_fields import FieldChecker
from defras_bt.executive.tree_header import SUBTREE, SubtreeOptions, TreeHeader
from defras_bt.executive.tree_includes import TreeIncludes
from defras_bt.executive.tree_kinds import KINDS, Kind
from defras_bt.executive.tree_port_flow import unwritten_reads
from defras_bt.executive.tree_ports import Wiring
from defras_bt.executive.tree_spec import NodeSpec, Place, Scope, TreeSpec, Wire
from defras_sim.yaml_source import Fault, InvalidFile, Location, YamlSource, read_yaml

_DEEPEST = 64
"""Levels of nesting, includes counted; deeper is a mistake, and would exhaust Python's stack."""


def read_tree(file: Path, registry: Registry = NODES, *, must_be_guarded: bool = True) -> TreeSpec:
    """Read a tree file and everything it includes.

    ``must_be_guarded``: whether a motion without a guard before it is a fault. It is one wherever a
    tree may be carried out; only to look at it, or to prove what it lacks, an unsafe one will do.

    Raises:
        InvalidFile: with everything that is wrong with any of the files. Whether motion is guarded
            is said once all nodes are understood.
    """
    return tree_from(read_yaml(file), registry, must_be_guarded=must_be_guarded)


def tree_from(
    source: YamlSource, registry: Registry = NODES, *, must_be_guarded: bool = True
) -> TreeSpec:
    """As :func:`read_tree`, of a file that was read already, or of what another format says."""
    file, faults = source.file, list[Fault]()
    tree = _Reader(source, faults, registry=registry, including=(file.resolve(),)).tree()
    if tree is not None and not faults:
        tree = Wiring(faults).wired(tree)
    if tree is not None and not faults:
        faults.extend(unwritten_reads(tree))
        guard_names = [name for name, node in registry.nodes().items() if node.role == "guard"]
        faults.extend(check_tree(tree.root, guard_names, must_be_guarded=must_be_guarded))
    if tree is None or faults:
        unique = dict.fromkeys(faults)  # a file included twice has its faults once
        raise InvalidFile(sorted(unique, key=lambda f: (f.file != file, f.file, f.line, f.column)))
    return tree


@dataclass(frozen=True, kw_only=True)
class _Reader(FieldChecker):
    """Reads one file; what is wrong with it is added to ``faults``, shared with its includes."""

    registry: Registry
    including: tuple[Path, ...]
    includes: TreeIncludes = field(default_factory=TreeIncludes)
    depth: int = 0
    given: Mapping[str, Wire] | None = None
    included_at: Place | None = None

    def tree(self, called: str | None = None) -> TreeSpec | None:
        """The tree of this file, its topmost node ``called`` otherwise than the file says."""
        header = self.checked((), self.source.data, TreeHeader, "a tree file")
        if "tree" not in self.source.data:
            return None
        name = called or (header.name if header is not None else "unnamed")
        root = self.node(("tree",), self.source.data["tree"], self.depth, name)
        if header is None or root is None:
            return None
        declared = {
            name: (self.place(("ports", name)), port) for name, port in header.ports.items()
        }
        place = self.included_at or self.place(())
        scope = Scope(self.source.file, declared, self.given, place)
        root = replace(root, scopes=(scope, *root.scopes))
        return TreeSpec(header.name, header.description, root, header.metric)

    def node(
        self, at: Location, data: Any, depth: int, called: str | None = None
    ) -> NodeSpec | None:
        """The node at ``at``, or None after noting why there is none."""
        if depth > _DEEPEST:
            self.fault(at, f"nested deeper than {_DEEPEST} levels")
            return None
        if (too_many := self.includes.count()) is not None:
            self.fault(at, too_many)
        if self.includes.full:
            return None
        if isinstance(data, str):
            kind: Any = data
            body: Any = {}
        elif isinstance(data, dict) and len(data) == 1:
            ((kind, body),) = data.items()
            at = (*at, kind)
        else:
            self.fault(at, _not_a_node(data))
            return None
        known = (*KINDS, SUBTREE, *self.registry.nodes())
        if kind not in known:
            self.fault(at, f"there is no node {kind!r}{did_you_mean(str(kind), known)}")
            self.look_below(at, body, depth)
            return None
        if body is None:
            self.fault(
                at, f"nothing stands under {kind}: indent what belongs to it, or drop the colon"
            )
            return None
        if not isinstance(body, dict):
            self.fault(at, f"{kind} should be followed by keys and values, not {body!r}")
            return None
        if called is not None and "name" in body:
            self.fault(
                (*at, "name"),
                f"the topmost node is called by the file's name ({called}); remove this one",
            )
            called = None
        if kind == SUBTREE:
            return self.subtree(at, body, depth, called)
        if kind in KINDS:
            return self.inner(at, KINDS[kind], body, depth, called)
        return self.leaf(at, kind, body, called)

    def leaf(
        self, at: Location, kind: str, body: Mapping[Any, Any], called: str | None
    ) -> NodeSpec | None:
        node_class = self.registry.look_up(kind)
        name = called or self.name(at, kind, body, snake_case(kind))
        ports = ports_of(node_class)
        own_keys = ("name", "ports") if ports else ("name",)
        options = self.checked(at, body, node_class.Parameters, kind, own_keys)
        wires = self.wires(at, kind, body) if ports else {}
        for port in wires or ():
            if port not in ports:
                message = f"{kind} has no port {port!r}{did_you_mean(port, ports)}"
                self.fault((*at, "ports", port), message)
        if name is None or options is None or wires is None:
            return None
        return NodeSpec(kind, name, self.place(at), options, node_class=node_class, wires=wires)

    def inner(
        self, at: Location, kind: Kind, body: Mapping[Any, Any], depth: int, called: str | None
    ) -> NodeSpec | None:
        name = called or self.name(at, kind.name, body, kind.name)
        before = len(self.faults)
        own_keys = ("name",) if kind.holds is None else ("name", kind.holds)
        options = self.checked(at, body, kind.options, kind.name, own_keys)
        children = self.children(at, kind, body, depth)
        if name is None or options is None or children is None:
            return None
        objection = kind.objection(options, [child.name for child in children])
        if objection is not None and len(self.faults) == before:
            self.fault(at, objection)
        return NodeSpec(kind.name, name, self.place(at), options, children)

    def children(
        self, at: Location, kind: Kind, body: Mapping[Any, Any], depth: int
    ) -> tuple[NodeSpec, ...] | None:
        """The children of an inner node; those that are at fault are left out."""
        if kind.holds is None:
            return ()
        if kind.holds not in body:
            self.fault(at, f"{kind.name} has no {kind.holds}: {_held(kind.holds)}")
            return None
        held, where = body[kind.holds], (*at, kind.holds)
        if kind.holds == "child":
            if isinstance(held, list):
                self.fault(where, f"{kind.name} has one child, not a list: {_held('child')}")
                return None
            child = self.node(where, held, depth + 1)
            return None if child is None else (child,)
        if not isinstance(held, list) or not held:
            self.fault(where, f"{kind.name}.children is empty or no list: {_held('list')}")
            return None
        found: dict[str, NodeSpec] = {}
        lines: dict[str, int] = {}
        for index, item in enumerate(held):
            child = self.node((*where, index), item, depth + 1)
            if child is not None and child.name in found:
                self.fault(
                    (*where, index),
                    f"a second child called {child.name!r} (see line {lines[child.name]}); "
                    "give one of them another name",
                )
            elif child is not None:
                found[child.name] = child
                lines[child.name] = self.place((*where, index))[1]
        return tuple(found.values())

    def look_below(self, at: Location, body: Any, depth: int) -> None:
        """Note what is wrong with whatever stands under a node of which nothing is known."""
        held = body if isinstance(body, dict) else {}
        children = held.get("children")
        for index, item in enumerate(children if isinstance(children, list) else ()):
            self.node((*at, "children", index), item, depth + 1)
        if "child" in held:
            self.node((*at, "child"), held["child"], depth + 1)

    def subtree(
        self, at: Location, body: Mapping[Any, Any], depth: int, called: str | None
    ) -> NodeSpec | None:
        name = called or self.name(at, SUBTREE, body, "")
        options = self.checked(at, body, SubtreeOptions, SUBTREE, ("name", "ports"))
        wires = self.wires(at, SUBTREE, body)
        if name is None or options is None or wires is None:
            return None
        folder = self.source.file.parent
        file = folder / options.file
        if not os.path.isfile(file):
            beside = sorted(path.name for path in folder.glob("*.yaml"))
            hint = did_you_mean(options.file, beside)
            self.fault((*at, "file"), f"there is no file {options.file!r}{hint}")
            return None
        if file.resolve() in self.including:
            chain = " -> ".join(path.name for path in (*self.including, file.resolve()))
            self.fault((*at, "file"), f"the file includes itself: {chain}")
            return None
        try:
            source = self.includes.source(file)
        except InvalidFile as error:
            self.faults.extend(error.faults)
            return None
        tree = _Reader(
            source,
            self.faults,
            registry=self.registry,
            including=(*self.including, file.resolve()),
            includes=self.includes,
            depth=depth,
            given=wires,
            included_at=self.place(at),
        ).tree(name or None)
        return None if tree is None else tree.root


def _held(what: str) -> str:
    if what == "child":
        return "give it one node, as in `child: SomeNode` or `child: {SomeNode: {limit: 3}}`"
    return "give it a list of at least one node, as in `children: [SomeNode, OtherNode]`"


def _not_a_node(data: Any) -> str:
    valid = "a node is its kind (`SomeNode`), or its kind as the one key over what it needs"
    if isinstance(data, dict) and data:
        keys = ", ".join(str(key) for key in data)
        return f"{valid}; here are {len(data)} keys side by side ({keys}): indent all but the kind"
    return f"{valid}, not {data!r}"
