"""Toy nodes whose statuses a test scripts, and tree files written on the fly."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest
from py_trees.common import Status
from pydantic import Field

from defras_bt.executive.loader import LoadedTree, load_tree
from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.registry import Registry


class ToyContext:
    """``says`` scripts the next statuses of a node by name (the last one stays); ``log`` notes
    every update and every termination of a leaf, in order."""

    def __init__(self) -> None:
        self.says: dict[str, list[Status]] = defaultdict(list)
        self.log: list[tuple[str, str]] = []

    def next_status(self, name: str, default: Status) -> Status:
        script = self.says[name]
        return script.pop(0) if len(script) > 1 else (script[0] if script else default)


class Toy(Node):
    """A leaf that does as the test says."""

    usual: ClassVar[Status] = Status.SUCCESS

    def update(self) -> Status:
        status = self.context.next_status(self.name, self.usual)
        self.context.log.append((self.name, status.name))
        report = {Status.SUCCESS: self.succeed, Status.FAILURE: self.fail}.get(status, self.run)
        return report("as_told", f"{self.name} was told {status.name}")

    def terminate(self, new_status: Status) -> None:
        self.context.log.append((self.name, f"ends {new_status.name}"))


class Watch(Toy):
    """A guard."""

    role: ClassVar[Role] = "guard"


class LimitParameters(NodeParameters):
    limit_n: float = Field(gt=0)
    patience_s: float = 0.5


class Limit(Watch):
    """A guard with parameters, one of them required."""

    Parameters = LimitParameters


class Push(Toy):
    """A motion that takes for ever unless told otherwise."""

    role: ClassVar[Role] = "motion"
    usual: ClassVar[Status] = Status.RUNNING


class Mend(Toy):
    """A recovery."""

    role: ClassVar[Role] = "recovery"


class Think(Toy):
    """A task."""

    role: ClassVar[Role] = "task"


@pytest.fixture
def toys() -> SimpleNamespace:
    """The toy classes and the ``registry`` that holds them; a test may register more."""
    registry = Registry()
    classes = {node.__name__: registry.register(node) for node in (Watch, Limit, Push, Mend, Think)}
    return SimpleNamespace(registry=registry, **classes)


@pytest.fixture
def toy_context() -> ToyContext:
    return ToyContext()


WriteTree = Callable[..., Path]


@pytest.fixture
def write_tree(tmp_path: Path) -> WriteTree:
    """``write_tree(text, file="tree.yaml")`` puts a tree file into a folder of this test."""

    def write(text: str, file: str = "tree.yaml") -> Path:
        path = tmp_path / file
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def load_toys(
    write_tree: WriteTree, toys: SimpleNamespace, toy_context: ToyContext
) -> Callable[[str], LoadedTree]:
    """``load_toys(text)`` loads the node written as ``text`` as a tree called "toy"."""

    def load(text: str) -> LoadedTree:
        indented = "\n".join(f"  {line}" for line in text.strip().splitlines())
        file = write_tree(f"name: toy\ntree:\n{indented}\n")
        return load_tree(file, toy_context, toys.registry)

    return load
