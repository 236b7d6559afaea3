"""Whether every port is written before it is read, whatever the leaves answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from py_trees.common import Status

from defras_bt.executive.ports import Port, Reads, ports_of
from defras_bt.executive.tree_decorators import DECORATORS, decorator_shows
from defras_bt.executive.tree_kinds import ParallelOptions
from defras_bt.executive.tree_spec import NodeSpec, TreeSpec
from defras_sim.yaml_source import Fault

Keys = frozenset[str]


def unwritten_reads(tree: TreeSpec) -> Iterator[Fault]:
    """A fault for each port that may be read before anything was written under its key.

    A value stays until it is replaced. It is surely there if it is given in a file, or where a leaf
    that writes it, or one that asked for it, must have succeeded before.
    """
    flow = _Flow(_writers(tree))
    flow.after(tree.root, tree.root.name, frozenset({*tree.values, *tree.needs}))
    yield from flow.faults


def _writers(tree: TreeSpec) -> Mapping[str, list[str]]:
    """Paths of the leaves that write under each key."""
    found: dict[str, list[str]] = {}
    for path, spec in tree.root.walk():
        for name, port in _ports(spec).items():
            if port.direction == "out":
                found.setdefault(spec.keys[name], []).append(path)
    return found


class _Flow:
    def __init__(self, writers: Mapping[str, list[str]]) -> None:
        self._writers = writers
        self.faults: list[Fault] = []

    def after(self, spec: NodeSpec, path: str, known: Keys) -> Keys:
        """Keys that surely have a value once ``spec`` succeeded; ``known`` have one before."""
        if spec.node_class is not None:
            return self._leaf(spec, path, known)
        if spec.kind in ("reactive", "sequence"):
            for child in spec.children:
                known = self.after(child, f"{path}/{child.name}", known)
            return known
        results = [self.after(child, f"{path}/{child.name}", known) for child in spec.children]
        if isinstance(spec.options, ParallelOptions):
            return _of_parallel(spec.options.succeed_when, spec.children, results)
        if spec.kind in DECORATORS:
            shows = decorator_shows(DECORATORS[spec.kind], spec.options)
            child_succeeded = all(
                (shown == Status.SUCCESS) <= (child == Status.SUCCESS)
                for child, shown in shows.items()
            )
            return results[0] if child_succeeded else known
        return frozenset.intersection(*results) if results else known

    def _leaf(self, spec: NodeSpec, path: str, known: Keys) -> Keys:
        added = set()
        for name, port in _ports(spec).items():
            key = spec.keys[name]
            if port.direction in ("out", "asked"):
                added.add(key)
            elif isinstance(port, Reads) and not port.has_default and key not in known:
                self._note(spec, path, name, key)
        return known | added

    def _note(self, spec: NodeSpec, path: str, name: str, key: str) -> None:
        writers = self._writers.get(key, [])
        if writers:
            remedy = (
                f"it is written by {', '.join(writers)}: put that before it under the same "
                f"`reactive` or `sequence`, or ask first with HasValue"
            )
        else:
            remedy = "nothing in the tree writes it; written are " + (
                ", ".join(sorted(self._writers)) or "no keys at all"
            )
        place = spec.wires[name].place if name in spec.wires else spec.place
        message = (
            f"{spec.kind} {path} reads port {name!r} before {key!r} is surely written; {remedy}"
        )
        self.faults.append(Fault(*place, message))


def _ports(spec: NodeSpec) -> Mapping[str, Port[Any]]:
    return ports_of(spec.node_class) if spec.node_class is not None else {}


def _of_parallel(
    succeed_when: str | tuple[str, ...], children: Sequence[NodeSpec], results: Sequence[Keys]
) -> Keys:
    if succeed_when == "one":
        return frozenset.intersection(*results)
    needed = [
        result
        for child, result in zip(children, results, strict=True)
        if succeed_when == "all" or child.name in succeed_when
    ]
    return frozenset.union(*needed)
