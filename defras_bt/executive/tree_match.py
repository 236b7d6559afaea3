"""Which node of one tree is which node of another, whatever was renamed, moved or changed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from defras_bt.executive.tree_spec import NodeSpec, Wire


@dataclass(frozen=True)
class Placed:
    """A node with its path and what stands around it. ``index`` counts siblings from 0."""

    path: str
    spec: NodeSpec
    parent: str | None
    index: int

    def walk(self) -> Iterator[Placed]:
        """This node and everything under it, parents before children."""
        yield self
        for index, child in enumerate(self.spec.children):
            yield from Placed(f"{self.path}/{child.name}", child, self.path, index).walk()


@dataclass
class Matching:
    """Pairs of paths: ``new_of`` leads from the old tree to the new one, ``old_of`` back."""

    old: Mapping[str, Placed]
    new: Mapping[str, Placed]
    new_of: dict[str, str]
    old_of: dict[str, str]

    def pair(self, old: str, new: str) -> None:
        self.new_of[old], self.old_of[new] = new, old

    def lost(self) -> list[Placed]:
        """Nodes of the old tree without a counterpart."""
        return [node for path, node in self.old.items() if path not in self.new_of]

    def gained(self) -> list[Placed]:
        """Nodes of the new tree without a counterpart."""
        return [node for path, node in self.new.items() if path not in self.old_of]


def match(old: NodeSpec, new: NodeSpec) -> Matching:
    """Pair the nodes of two trees, the surest pairs first.

    A node keeps its counterpart if path and kind are the same. Of the rest, whole subtrees that
    mean the same are paired wherever they stand, then nodes of one kind, or of one name, under
    parents that are a pair, and at last nodes of one kind and name wherever they stand.
    """
    olds = {placed.path: placed for placed in Placed(old.name, old, None, 0).walk()}
    news = {placed.path: placed for placed in Placed(new.name, new, None, 0).walk()}
    found = Matching(olds, news, {}, {})
    found.pair(old.name, new.name)
    _same_place(found, old.name, new.name)
    _same_meaning(found, lambda spec: (spec.name, meaning(spec)))
    _same_meaning(found, meaning)
    # A pair may make its children candidates, so this goes on until nothing is found any more.
    while _alike(found):
        pass
    for node in found.lost():
        twins = [other for other in found.gained() if _called(other) == _called(node)]
        if len(twins) == 1:
            found.pair(node.path, twins[0].path)
    return found


def _called(node: Placed) -> tuple[str, str]:
    return node.spec.kind, node.spec.name


def meaning(spec: NodeSpec) -> object:
    """What a node and all under it do; equal for nodes that only differ in name and place."""
    ports = tuple(sorted(ports_said(spec).items()))
    return spec.kind, repr(spec.options), ports, tuple(meaning(child) for child in spec.children)


def ports_said(spec: NodeSpec) -> dict[str, str]:
    """What is said about each port of a leaf, or of the files whose topmost node this is."""
    said = {port: _said(wire) for port, wire in spec.wires.items()}
    for scope in spec.scopes:
        defaults = {name: port.default for name, (_, port) in scope.declared.items()}
        said.update({name: repr(value) for name, value in defaults.items() if value is not None})
        said.update({port: _said(wire) for port, wire in (scope.given or {}).items()})
    return said


def _said(wire: Wire) -> str:
    return f"the key {wire.key}" if wire.key is not None else repr(wire.value)


def _same_place(found: Matching, old: str, new: str) -> None:
    news = {child.name: child for child in found.new[new].spec.children}
    for child in found.old[old].spec.children:
        other = news.get(child.name)
        if other is not None and other.kind == child.kind:
            found.pair(f"{old}/{child.name}", f"{new}/{child.name}")
            _same_place(found, f"{old}/{child.name}", f"{new}/{child.name}")


def _same_meaning(found: Matching, of: Callable[[NodeSpec], object]) -> None:
    """Pair subtrees for which ``of`` is the same, whole, the largest first."""
    candidates: dict[object, list[Placed]] = {}
    for node in found.gained():
        candidates.setdefault(of(node.spec), []).append(node)
    for node in sorted(found.lost(), key=lambda placed: -sum(1 for _ in placed.walk())):
        if node.path in found.new_of:
            continue
        free = [n for n in candidates.get(of(node.spec), []) if n.path not in found.old_of]
        if free:
            beside = [n for n in free if n.parent == found.new_of.get(node.parent or "")]
            for one, other in zip(node.walk(), (beside or free)[0].walk(), strict=True):
                if one.path not in found.new_of and other.path not in found.old_of:
                    found.pair(one.path, other.path)


def _alike(found: Matching) -> bool:
    """Pair one more node with one under the same parent: of its name, else of its kind."""
    for node in found.lost():
        parent = found.new_of.get(node.parent or "")
        beside = [other for other in found.gained() if other.parent == parent]
        named = [other for other in beside if other.spec.name == node.spec.name]
        kin = [other for other in beside if other.spec.kind == node.spec.kind]
        if parent is not None and (named or kin):
            found.pair(node.path, (named or kin)[0].path)
            _same_place(found, node.path, (named or kin)[0].path)
            return True
    return False
