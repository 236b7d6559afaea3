"""A behaviour tree as it was read from its files, before anything is there to be ticked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import BaseModel

from defras_bt.executive.node import Node

MetricName = Literal["local", "median"]

Place = tuple[Path, int, int]
"""File, line and column; the latter two count from 1."""


@dataclass(frozen=True)
class NodeSpec:
    """One node. ``node_class`` is None for an inner node, whose ``kind`` is one of KINDS.

    ``options`` holds the parameters of a leaf or the options of a kind, already validated.
    """

    kind: str
    name: str
    place: Place
    options: BaseModel
    children: tuple[NodeSpec, ...] = ()
    node_class: type[Node] | None = None

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
    """

    name: str
    description: str
    root: NodeSpec
    metric: MetricName | None = None
