"""A behaviour tree as it was read from its files, before anything is there to be ticked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel

from defras_bt.executive.node import Node

if TYPE_CHECKING:
    from defras_bt.executive.tree_ports import PortDeclaration

MetricName = Literal["local", "median"]

Place = tuple[Path, int, int]
"""File, line and column; the latter two count from 1."""


@dataclass(frozen=True)
class Wire:
    """What a file says about a port: the key that it leads to, or (``key`` None) its value."""

    place: Place
    key: str | None = None
    value: Any = None


@dataclass(frozen=True)
class Scope:
    """A file that was included, or the one that was read: its ports, and what they are given.

    ``declared`` holds place and declaration of each port; ``given`` is None for the file that was
    read, which nobody includes; ``place`` is where the file is included.
    """

    file: Path
    declared: Mapping[str, tuple[Place, PortDeclaration]]
    given: Mapping[str, Wire] | None
    place: Place


@dataclass(frozen=True)
class NodeSpec:
    """One node. ``node_class`` is None for an inner node, whose ``kind`` is one of KINDS.

    ``options`` holds the parameters of a leaf or the options of a kind, already validated.
    ``wires`` is what the file says about the ports of a leaf, and ``keys`` the key that each of
    them has in the whole tree. ``scopes`` are the files, outermost first, whose topmost node this
    is.
    """

    kind: str
    name: str
    place: Place
    options: BaseModel
    children: tuple[NodeSpec, ...] = ()
    node_class: type[Node] | None = None
    wires: Mapping[str, Wire] = field(default_factory=dict)
    keys: Mapping[str, str] = field(default_factory=dict)
    scopes: tuple[Scope, ...] = ()

    def walk(self, above: str = "") -> Iterator[tuple[str, NodeSpec]]:
        """Path and node of this node and everything under it, parents before children."""
        path = f"{above}{self.name}"
        yield path, self
        for child in self.children:
            yield from child.walk(f"{path}/")


@dataclass(frozen=True)
class TreeSpec:
    """A whole tree; ``root.name`` is ``name``.

    ``metric`` names the discrepancy whose warning states count; None: a tree without monitoring.
    ``values`` are those that files give to ports, by key; ``needs`` the keys that only a tree that
    includes this one can fill, with the place at which each is declared.
    """

    name: str
    description: str
    root: NodeSpec
    metric: MetricName | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    needs: Mapping[str, Place] = field(default_factory=dict)
