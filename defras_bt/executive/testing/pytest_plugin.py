"""pytest plugin: a fresh bench for every test, and coverage of trees over a session.

In a conftest.py: ``pytest_plugins = ["defras_bt.executive.testing.pytest_plugin"]``. Then
``pytest --tree-coverage seen.jsonl`` notes every node that an executive or a bench ticks; each
process of the session appends a line. ``defras tree coverage seen.jsonl`` shows it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.executive import Executive
from defras_bt.executive.node import Node
from defras_bt.executive.testing.bench import NodeBench
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.recording.coverage import Coverage


@pytest.fixture
def node_bench() -> NodeBench:
    """A bench on which this test ticks nodes."""
    return NodeBench()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--tree-coverage",
        type=Path,
        metavar="FILE",
        help="append to FILE which nodes of which trees were ticked, and what they answered",
    )


def pytest_configure(config: pytest.Config) -> None:
    file: Path | None = config.getoption("--tree-coverage")
    if file is not None:
        config.pluginmanager.register(SessionCoverage(file.absolute()), "defras-tree-coverage")


class SessionCoverage:
    """Listens to every executive and every bench from the start of a session to its end."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.coverage = Coverage()
        self._undo: list[Callable[[], None]] = []

    def pytest_sessionstart(self) -> None:
        executive_tick, bench_tick = Executive.tick, NodeBench.tick

        def tick_executive(executive: Executive) -> None:
            executive_tick(executive)
            self._heard(executive)

        def tick_bench(bench: NodeBench, node: Behaviour) -> Status:
            status = bench_tick(bench, node)
            if isinstance(node, Node):
                self.coverage.leaf(type(node).__name__, status.name, node.code)
            return status

        setattr(Executive, "tick", tick_executive)  # noqa: B010  (mypy knows it as a method)
        setattr(NodeBench, "tick", tick_bench)  # noqa: B010
        self._undo = [
            lambda: setattr(Executive, "tick", executive_tick),
            lambda: setattr(NodeBench, "tick", bench_tick),
        ]

    def pytest_sessionfinish(self) -> None:
        for undo in self._undo:
            undo()
        if self.coverage.trees or self.coverage.leaves:
            with self._file.open("a", encoding="utf-8") as stream:
                stream.write(self.coverage.text() + "\n")

    def _heard(self, executive: Executive) -> None:
        record = executive.last
        if record is None:
            return
        kinds = dict(executive.tree.kinds())
        for path, status in record.node_status.items():
            if status and path in kinds:
                kind, code = kinds[path], record.node_code.get(path, "")
                self.coverage.in_tree(executive.tree.name, path, kind, status, code)
                if kind not in KINDS:
                    self.coverage.leaf(kind, status, code)
