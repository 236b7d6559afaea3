"""Which nodes of a tree were ticked, and which of their answers were seen."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from defras_bt.recording.decision_reader import Decisions, read_decisions

SCHEMA = "defras/coverage/1"


class InvalidCoverage(ValueError):
    """A file that does not hold coverage; the message says where and what would be valid."""


@dataclass(frozen=True)
class Seen:
    """How often one node gave each status, and each code."""

    kind: str
    statuses: Counter[str] = field(default_factory=Counter)
    codes: Counter[str] = field(default_factory=Counter)

    def add(self, status: str, code: str, times: int = 1) -> None:
        self.statuses[status] += times
        if code:
            self.codes[code] += times


@dataclass(frozen=True)
class Coverage:
    """``trees``: by the name of the tree, then by path. ``leaves``: by class, wherever they were.

    Scripted leaves count nowhere: what they answer says nothing about the nodes they replace.
    """

    trees: dict[str, dict[str, Seen]] = field(default_factory=dict)
    leaves: dict[str, Seen] = field(default_factory=dict)

    def in_tree(self, tree: str, path: str, kind: str, status: str, code: str) -> None:
        """Note one tick of a node."""
        if kind != "ScriptedLeaf":
            nodes = self.trees.setdefault(tree, {})
            nodes.setdefault(path, Seen(kind)).add(status, code)

    def leaf(self, kind: str, status: str, code: str) -> None:
        """Note one tick of a leaf of class ``kind``, in a tree or on its own."""
        if kind != "ScriptedLeaf":
            self.leaves.setdefault(kind, Seen(kind)).add(status, code)

    def text(self) -> str:
        """As one line of a coverage file."""
        return json.dumps(
            {
                "schema": SCHEMA,
                "trees": {
                    tree: {path: _plain(seen) for path, seen in nodes.items()}
                    for tree, nodes in self.trees.items()
                },
                "leaves": {kind: _plain(seen) for kind, seen in self.leaves.items()},
            }
        )


def coverage_of_run(decisions: Decisions) -> Coverage:
    """What a recorded run covered."""
    coverage = Coverage()
    for moment in decisions.moments():
        for path, word in moment.nodes.items():
            if word.ticked:
                kind = decisions.kinds.get(path, "")
                coverage.in_tree(decisions.tree, path, kind, word.status, word.code)
    return coverage


def read_coverage(files: Iterable[Path]) -> Coverage:
    """Everything that runs (their folders) and test sessions (files of the pytest plugin) covered.

    Raises:
        InvalidCoverage: a file is neither.
        InvalidDecisions: a run's record cannot be read.
    """
    total = Coverage()
    for file in files:
        if file.is_dir() or file.name.endswith("decisions.jsonl"):
            _merge(total, coverage_of_run(read_decisions(file)))
        else:
            for one in _lines(file):
                _merge(total, one)
    return total


def _lines(file: Path) -> Iterator[Coverage]:
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidCoverage(
            f"{file} cannot be read ({error}); give a folder that defras run --out left, or a file "
            "that pytest --tree-coverage wrote"
        ) from error
    for number, line in enumerate(lines, 1):
        try:
            content = json.loads(line)
            if content["schema"] != SCHEMA:
                raise ValueError(f"schema is {content['schema']!r}, valid is {SCHEMA!r}")
            yield Coverage(
                {
                    tree: {path: _read(seen) for path, seen in nodes.items()}
                    for tree, nodes in content["trees"].items()
                },
                {kind: _read(seen) for kind, seen in content["leaves"].items()},
            )
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InvalidCoverage(f"{file}:{number}: no coverage: {error!r}") from error


def _merge(total: Coverage, one: Coverage) -> None:
    for tree, nodes in one.trees.items():
        for path, seen in nodes.items():
            _add(total.trees.setdefault(tree, {}), path, seen)
    for kind, seen in one.leaves.items():
        _add(total.leaves, kind, seen)


def _add(counts: dict[str, Seen], key: str, seen: Seen) -> None:
    known = counts.setdefault(key, Seen(seen.kind))
    known.statuses.update(seen.statuses)
    known.codes.update(seen.codes)


def _plain(seen: Seen) -> Mapping[str, Any]:
    return {"kind": seen.kind, "statuses": dict(seen.statuses), "codes": dict(seen.codes)}


def _read(said: Mapping[str, Any]) -> Seen:
    return Seen(str(said["kind"]), Counter(said["statuses"]), Counter(said["codes"]))
