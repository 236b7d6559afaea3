"""The files that a tree is made of: each is read once, and together they must not grow without end.

Two files that include the next one twice each, and so on, are a few lines that stand for millions
of nodes, as aliases of aliases are within one file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from defras_sim.yaml_source import YamlSource, read_yaml

MOST_NODES = 2_000
"""So many nodes a tree may have, includes counted; a plan is no part of it; those shipped have
fewer than a hundred."""


@dataclass
class TreeIncludes:
    """Shared by all that read files of one tree. ``nodes`` counts what was read so far."""

    nodes: int = 0
    _sources: dict[Path, YamlSource] = field(default_factory=dict)

    @property
    def full(self) -> bool:
        """Whether there are too many nodes already: nothing more has to be read then."""
        return self.nodes > MOST_NODES

    def count(self) -> str | None:
        """Count one more node; what is wrong with the one that is too many."""
        self.nodes += 1
        if self.nodes != MOST_NODES + 1:
            return None
        return f"the tree has too many nodes: at most {MOST_NODES} are valid, includes counted"

    def source(self, file: Path) -> YamlSource:
        """The content of ``file``.

        Raises:
            InvalidFile: it cannot be read.
        """
        known = file.resolve()
        if known not in self._sources:
            self._sources[known] = read_yaml(file)
        return self._sources[known]
