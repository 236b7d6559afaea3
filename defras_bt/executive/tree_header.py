"""What stands at the top of a tree file, and where one file includes another."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from defras_bt.executive.node import NodeParameters
from defras_bt.executive.tree_fields import NAME_PATTERN
from defras_bt.executive.tree_ports import PortDeclaration
from defras_bt.executive.tree_spec import MetricName

SUBTREE = "subtree"
"""The kind that stands for the tree of another file."""


class TreeHeader(NodeParameters):
    """Top level of a tree file."""

    name: str = Field(pattern=NAME_PATTERN, description="Name of the tree and its topmost node.")
    description: str = Field(default="", description="What the tree does, for people.")
    metric: MetricName | None = Field(
        default=None,
        description="The discrepancy whose warning states count; left out: no monitoring.",
    )
    ports: dict[Annotated[str, Field(pattern=NAME_PATTERN)], PortDeclaration] = Field(
        default={}, description="Values that the tree is given, or gives, where it is included."
    )
    tree: Any = Field(description="The topmost node.")


class SubtreeOptions(NodeParameters):
    """Which file to put here."""

    file: str = Field(
        pattern=r"^[^\x00-\x1f]+\.ya?ml$",
        description="Another tree file (.yaml), relative to this one.",
    )
