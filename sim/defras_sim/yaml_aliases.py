"""Aliases of a YAML file: a few lines must not stand for millions."""

from __future__ import annotations

from dataclasses import dataclass

from ruamel.yaml import YAML
from ruamel.yaml.error import StringMark
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, NodeEvent

MOST_ALIASED_NODES = 10_000
"""So many values may come into a file through its aliases; a large scene has some hundreds."""


@dataclass(frozen=True)
class AliasFault:
    """An alias that cannot be used. Line and column count from 1."""

    line: int
    column: int
    message: str


def alias_fault(text: str) -> AliasFault | None:
    """The first alias that stands within its own anchor, or that makes the file too large.

    Sizes are added up from the events of the parser, so that nothing is ever expanded.

    Raises:
        YAMLError: the text is not YAML.
    """
    sizes: dict[str, int] = {}
    open_nodes: list[tuple[str | None, int]] = []
    total, aliased = 0, 0
    for event in YAML(typ="rt", pure=True).parse(text):
        if isinstance(event, AliasEvent):
            name = str(event.anchor)
            if any(anchor == name for anchor, _ in open_nodes):
                return _at(event.start_mark, f"*{name} stands within &{name} itself")
            # An alias of nothing is the composer's to complain about.
            aliased += sizes.get(name, 0)
            total += sizes.get(name, 0)
            if aliased > MOST_ALIASED_NODES:
                return _at(
                    event.start_mark,
                    f"with *{name} the aliases of this file stand for {aliased} values; at most "
                    f"{MOST_ALIASED_NODES} are valid: write out what is meant",
                )
        elif isinstance(event, CollectionEndEvent):
            anchor, before = open_nodes.pop()
            if anchor is not None:
                sizes[anchor] = total - before
        elif isinstance(event, NodeEvent):
            anchor = event.anchor
            if isinstance(event, CollectionStartEvent):
                open_nodes.append((anchor, total))
            elif anchor is not None:
                sizes[anchor] = 1
            total += 1
    return None


def _at(mark: StringMark, message: str) -> AliasFault:
    return AliasFault(mark.line + 1, mark.column + 1, message)
