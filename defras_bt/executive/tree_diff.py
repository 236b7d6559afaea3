"""What changed between two trees, by what it means; lost guards first."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from py_trees.common import Status

from defras_bt.executive.proof.facts import Numbered, numbered
from defras_bt.executive.proof.guards import Condition, guarding
from defras_bt.executive.tree_decorators import DECORATORS, decorator_shows
from defras_bt.executive.tree_kinds import KINDS, ParallelOptions
from defras_bt.executive.tree_match import Matching, Placed, match, ports_said
from defras_bt.executive.tree_spec import NodeSpec, TreeSpec

ChangeKind = Literal[
    "guard lost", "kind", "parameter", "moved", "renamed", "removed", "added", "file"
]

_MARKS: dict[ChangeKind, str] = {
    "guard lost": "!",
    "file": "~",
    "kind": "~",
    "parameter": "~",
    "moved": ">",
    "renamed": "=",
    "removed": "-",
    "added": "+",
}


@dataclass(frozen=True)
class Change:
    """One change; ``path`` is that of the new tree, or of the old one for what is gone."""

    kind: ChangeKind
    path: str
    sentence: str

    def __str__(self) -> str:
        return f"{_MARKS[self.kind]} {self.path}: {self.sentence}"


def tree_diff(old: TreeSpec, new: TreeSpec) -> list[Change]:
    """Every change from ``old`` to ``new``; empty if they mean the same.

    Comments, layout, the order of keys, and whether a part stands in a file of its own mean
    nothing.
    """
    found = match(old.root, new.root)
    return [
        *_lost_guards(found, old, new),
        *_header(old, new),
        *_of_pairs(found),
        *_moved(found),
        *_gone_and_new(found),
    ]


def _header(old: TreeSpec, new: TreeSpec) -> Iterator[Change]:
    if old.metric != new.metric:
        yield Change("file", new.name, _listens(new.metric, old.metric))


def _listens(now: str | None, was: str | None) -> str:
    if was is None:
        return f"listens to the metric {now} now; it listened to none before"
    if now is None:
        return f"listens to no metric any more; it listened to {was}"
    return f"listens to the metric {now}, not {was}"


def _of_pairs(found: Matching) -> Iterator[Change]:
    """Renamed nodes, other kinds and parameters."""
    for old_path, new_path in found.new_of.items():
        old, new = found.old[old_path].spec, found.new[new_path].spec
        if old.name != new.name:
            yield Change("renamed", new_path, f"was called {old.name}")
        if old.kind != new.kind:
            yield Change("kind", new_path, f"is {_article(new)}, no longer {_article(old)}")
            continue
        before, after = old.options.model_dump(), new.options.model_dump()
        for name, value in after.items():
            if before[name] != value:
                yield Change("parameter", new_path, f"{name} {_became(value, before[name])}")
        was, now = ports_said(old), ports_said(new)
        for port in sorted({*was, *now}):
            said = [ports.get(port, f"the key {port}") for ports in (now, was)]
            if said[0] != said[1]:
                yield Change("parameter", new_path, f"port {port} is {said[0]}, not {said[1]}")


def _became(now: object, was: object) -> str:
    """What became of a parameter; None is one of which the file says nothing."""
    if was is None:
        return f"is {now!r}; it was not given before"
    if now is None:
        return f"is not given any more; it was {was!r}"
    return f"is {now!r}, not {was!r}"


def _article(spec: NodeSpec) -> str:
    if spec.kind not in KINDS:
        return spec.kind
    first, _, rest = KINDS[spec.kind].description.partition(".")
    return f"{spec.kind} ({first[0].lower()}{first[1:]})" if rest or first else spec.kind


def _moved(found: Matching) -> Iterator[Change]:
    """Nodes under another parent, and the fewest that explain another order."""
    for old_path, new_path in found.new_of.items():
        old, new = found.old[old_path], found.new[new_path]
        if old.parent is not None and found.new_of.get(old.parent) != new.parent:
            yield Change("moved", new_path, f"stood under {old.parent}")
        stayed = [
            found.new[path]
            for child in old.spec.children
            if (path := found.new_of.get(f"{old_path}/{child.name}")) is not None
            and found.new[path].parent == new_path
        ]
        kept = _longest_rising([node.index for node in stayed])
        for node in stayed:
            if node.index not in kept:
                after = new.spec.children[node.index - 1].name if node.index else None
                where = f"comes after {after} now" if after else "comes first now"
                yield Change("moved", node.path, where)


def _longest_rising(numbers: list[int]) -> set[int]:
    """The longest rising selection of different numbers: what stayed in order."""
    ends: list[int] = []
    chains: list[tuple[int, ...]] = []
    for number in numbers:
        place = bisect_left(ends, number)
        chain = (*(chains[place - 1] if place else ()), number)
        ends[place : place + 1], chains[place : place + 1] = [number], [chain]
    return set(chains[-1]) if chains else set()


def _gone_and_new(found: Matching) -> Iterator[Change]:
    """The topmost nodes of what is only in one tree."""
    lost, gained = found.lost(), found.gained()
    for node in _topmost(lost):
        yield Change("removed", node.path, f"{_size(node, lost)} is gone")
    for node in _topmost(gained):
        yield Change("added", node.path, f"{_size(node, gained)} is new")


def _topmost(nodes: list[Placed]) -> list[Placed]:
    paths = {node.path for node in nodes}
    return [node for node in nodes if node.parent not in paths]


def _size(node: Placed, among: list[Placed]) -> str:
    """Kind of a node, and how much ``among`` those without a counterpart stands under it."""
    under = sum(other.path.startswith(f"{node.path}/") for other in among)
    nodes = "node" if under == 1 else "nodes"
    return node.spec.kind + (f" with {under} {nodes} under it" if under else "")


def _lost_guards(found: Matching, old: TreeSpec, new: TreeSpec) -> Iterator[Change]:
    """Motions and plan slots that a guard no longer stops as it did."""
    before, after = _guards(numbered(old.root)), _guards(numbered(new.root))
    for old_path, guards in before.items():
        new_path = found.new_of.get(old_path)
        if new_path is None:
            continue
        still = after.get(new_path, frozenset())
        for guard in sorted(guards, key=lambda guard: guard.path):
            if replace(guard, path=found.new_of.get(guard.path, "")) not in still:
                inverted = "" if guard.answer == Status.SUCCESS else " (inverted)"
                among = " together with others" if guard.alternative else ""
                yield Change(
                    "guard lost",
                    new_path,
                    f"is no longer stopped in the same tick by {guard.path}{inverted}{among}",
                )


@dataclass(frozen=True)
class _Guard:
    """A guard above a motion. ``alternative``: it is enough if another one answers so."""

    path: str
    answer: Status
    alternative: bool


def _guards(root: Numbered) -> dict[str, frozenset[_Guard]]:
    """For each motion and plan slot the guards that stop it in the tick in which they answer."""
    paths = {node.number: node.path for node in root.walk()}
    found: dict[str, frozenset[_Guard]] = {}

    def go(node: Numbered, above: frozenset[_Guard]) -> None:
        if node.moves or node.is_slot:
            found[node.path] = above
        for index, child in enumerate(node.children):
            here = above
            reactive = node.spec is not None and node.spec.kind == "reactive"
            for other, wanted in guarding(node, index) if reactive else ():
                if _asks_anew(node.children[other]):
                    here |= frozenset(_literals(wanted, paths))
            go(child, here)

    go(root, frozenset())
    return found


def _literals(
    wanted: Condition, paths: Mapping[int, str], alternative: bool = False
) -> Iterator[_Guard]:
    if wanted.kind == "literal":
        yield _Guard(paths[wanted.node], wanted.answer, alternative)
    for part in wanted.parts:
        yield from _literals(part, paths, alternative or wanted.kind == "some")


def _asks_anew(node: Numbered) -> bool:
    """Whether a branch of guards succeeds only where its guards do so in the same tick."""
    if node.spec is None or node.spec.node_class is not None:
        return True
    if not all(map(_asks_anew, node.children)):
        return False
    if isinstance(node.spec.options, ParallelOptions):
        return not node.spec.options.synchronise
    if node.spec.kind in DECORATORS and node.spec.kind != "invert":
        shows = decorator_shows(DECORATORS[node.spec.kind], node.spec.options)
        hides = Status.SUCCESS in (shows[Status.FAILURE], shows[Status.RUNNING])
        return not hides and node.spec.kind != "once"
    return node.spec.kind != "sequence"
