"""Toy leaves with ports."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from py_trees.common import Status

from defras_bt.executive.node import Node
from defras_bt.executive.port_nodes import HasValue
from defras_bt.executive.ports import PortValues, Reads, Writes
from defras_bt.executive.registry import Registry


@dataclass
class PortBoard:
    """As much of a blackboard as ports need."""

    ports: PortValues = field(default_factory=PortValues)


@dataclass
class PortContext:
    """``writes`` is what :class:`Measure` writes next; ``read`` what :class:`Hold` read."""

    board: PortBoard = field(default_factory=PortBoard)
    writes: list[Any] = field(default_factory=list)
    read: list[Any] = field(default_factory=list)


class Measure(Node):
    """Writes a tension."""

    role = "task"
    tension_n = Writes(float, "Tension [N].")

    def update(self) -> Status:
        if self.context.writes:
            self.tension_n = self.context.writes.pop(0)
        return self.succeed("measured", "measured")


class Hold(Node):
    """Reads a tension."""

    role = "task"
    wanted_n = Reads(float, "Tension to hold [N].")

    def update(self) -> Status:
        self.context.read.append(self.wanted_n)
        return self.succeed("held", "held")


class Patient(Node):
    """Reads a number, or takes 3."""

    role = "task"
    times = Reads(int, "How often.", default=3)

    def update(self) -> Status:
        self.context.read.append(self.times)
        return self.succeed("read", "read")


class Label(Node):
    """Writes a text."""

    role = "task"
    label = Writes(str, "What it is.")

    def update(self) -> Status:
        self.label = "a label"
        return self.succeed("labelled", "labelled")


def port_registry() -> Registry:
    registry = Registry()
    for node in (Measure, Hold, Patient, Label, HasValue):
        registry.register(node)
    return registry
