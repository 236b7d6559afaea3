"""Trees as text: for a terminal, with what every node last said, and as a Mermaid diagram."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour

from defras_bt.executive.node import Node
from defras_bt.executive.registry import snake_case
from defras_bt.executive.tree_kinds import kind_of
from defras_bt.executive.tree_spec import NodeSpec

_SYMBOLS = {
    "reactive": "⇉",
    "sequence": "→",
    "reactive_selector": "⁇",
    "selector": "?",
    "parallel": "∥",
    "plan_slot": "▤",
    "guard": "◆",
    "motion": "▶",
    "recovery": "↻",
    "task": "•",
}
_DECORATOR = "◇"

_MARKS = {"SUCCESS": "✓", "FAILURE": "✗", "RUNNING": "…", "": "·"}
"""Mark of each status; "" means that the node was not ticked."""

_SHAPES = {"guard": ("{{", "}}"), "motion": ("[/", "/]"), "recovery": ("([", "])")}


@dataclass(frozen=True)
class Outline:
    """What there is to show of a node. ``role`` is "" for an inner node."""

    path: str
    name: str
    kind: str
    role: str
    detail: str
    children: tuple[Outline, ...]

    @property
    def label(self) -> str:
        """Symbol, name, and whatever the name does not tell: the kind, the parameters."""
        symbol = _SYMBOLS.get(self.role or self.kind, _DECORATOR)
        kind = "" if self.name in (self.kind, snake_case(self.kind)) else f" ({self.kind})"
        return f"{symbol} {self.name}{kind}{self.detail}"


def outline_of_spec(spec: NodeSpec, above: str = "") -> Outline:
    """Outline of a tree as it stands in its files; nothing needs to be there to run it."""
    path = f"{above}{spec.name}"
    given = spec.options.model_dump(exclude_defaults=True)
    wires = {port: key for port, key in spec.keys.items() if port != key}
    return Outline(
        path,
        spec.name,
        spec.kind,
        "" if spec.node_class is None else spec.node_class.role,
        "".join(f" {key}={value}" for key, value in given.items())
        + "".join(f" {port}@{key}" for port, key in wires.items()),
        tuple(outline_of_spec(child, f"{path}/") for child in spec.children),
    )


def outline_of_tree(root: Behaviour, above: str = "") -> Outline:
    """Outline of a tree as it is now, the actions of a plan included."""
    path = f"{above}{root.name}"
    is_leaf = isinstance(root, Node)
    given = root.parameters.model_dump(exclude_defaults=True) if is_leaf else {}
    return Outline(
        path,
        root.name,
        kind_of(root),
        root.role if is_leaf else "",
        "".join(f" {key}={value}" for key, value in given.items()),
        tuple(outline_of_tree(child, f"{path}/") for child in root.children),
    )


def show_text(
    outline: Outline,
    statuses: Mapping[str, str] | None = None,
    messages: Mapping[str, str] | None = None,
) -> str:
    """One line a node, indented with box lines.

    ``statuses`` maps a path to SUCCESS, FAILURE, RUNNING or "" (not ticked) and ``messages`` to its
    last word, as in a TickRecord; both may leave out paths.
    """

    def line(node: Outline) -> str:
        mark = "" if statuses is None else f"{_MARKS[statuses.get(node.path, '')]} "
        message = (messages or {}).get(node.path, "")
        return f"{mark}{node.label}" + (f": {message}" if message else "")

    def under(node: Outline, indent: str) -> Iterator[str]:
        for index, child in enumerate(node.children):
            last = index == len(node.children) - 1
            yield f"{indent}{'└─ ' if last else '├─ '}{line(child)}"
            yield from under(child, indent + ("   " if last else "│  "))

    return "\n".join([line(outline), *under(outline, "")])


def show_mermaid(outline: Outline) -> str:
    """A Mermaid flowchart: guards are hexagons, motions parallelograms, recoveries rounded."""
    lines = ["flowchart TD"]

    def add(node: Outline) -> str:
        identity = f"n{len(lines)}"
        left, right = _SHAPES.get(node.role, ("[", "]"))
        label = node.label.replace('"', "'")
        lines.append(f'    {identity}{left}"{label}"{right}')
        for child in node.children:
            lines.append(f"    {identity} --> {add(child)}")
        return identity

    add(outline)
    return "\n".join(lines)
