"""Which node classes a tree file may name: the built-in ones and those of users' packages."""

from __future__ import annotations

import difflib
import importlib
import inspect
import re
from collections.abc import Collection, Mapping
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import TypeVar, get_args

from py_trees.behaviours import Dummy
from pydantic import BaseModel

from defras_bt.executive.node import Node, Role
from defras_bt.executive.ports import ports_of

NodeClass = TypeVar("NodeClass", bound=type[Node])

BUILTIN_NODE_MODULES: tuple[str, ...] = (
    "defras_bt.acting.reach",
    "defras_bt.acting.jaw",
    "defras_bt.acting.manoeuvre",
    "defras_bt.acting.let_go",
    "defras_bt.monitoring.guards",
    "defras_bt.learning.nodes",
    "defras_bt.learning.probe.nodes",
    "defras_bt.diagnosis.mismatch.nodes",
    "defras_bt.planning.nodes",
    "defras_bt.executive.operator_nodes",
    "defras_bt.executive.nodes",
    "defras_bt.executive.port_nodes",
)
"""Modules whose import registers the nodes that come with this project."""

ENTRY_POINT_GROUP = "defras.nodes"
"""Entry points of users' packages; each names a module whose import registers nodes."""

_NAMES_IN_EVERY_NODE = frozenset(dir(Node)) | frozenset(vars(Dummy()))

_CLASS_NAME = re.compile(r"([A-Z][a-z0-9]*)+")


class UnknownNode(LookupError):
    """No registered node class has this name; the message says which have a similar one."""


class Registry:
    """Node classes by name. Modules named at construction are imported on the first look-up."""

    def __init__(self, modules: tuple[str, ...] = (), entry_point_group: str | None = None) -> None:
        self._modules = modules
        self._entry_point_group = entry_point_group
        self._classes: dict[str, type[Node]] = {}
        self._loaded = False

    def register(self, node_class: NodeClass) -> NodeClass:
        """Class decorator: make ``node_class`` available to tree files under its class name.

        Raises:
            TypeError: the class cannot serve as a node, or its name is taken.
        """
        name = node_class.__name__
        fault = _unfit(node_class)
        if fault:
            raise TypeError(f"node {name} ({node_class.__module__}) {fault}")
        known = self._classes.get(name)
        if known is not None and known.__module__ != node_class.__module__:
            raise TypeError(
                f"node {name} is defined in {known.__module__} and in {node_class.__module__}; "
                "rename one of them"
            )
        self._classes[name] = node_class
        return node_class

    def nodes(self) -> Mapping[str, type[Node]]:
        """Every node class by name, in alphabetical order."""
        self._load()
        return MappingProxyType(dict(sorted(self._classes.items())))

    def look_up(self, name: str) -> type[Node]:
        """The node class called ``name``.

        Raises:
            UnknownNode: there is none; the message proposes similar names.
        """
        self._load()
        if name not in self._classes:
            raise UnknownNode(f"there is no node {name!r}{did_you_mean(name, self._classes)}")
        return self._classes[name]

    def _load(self) -> None:
        if self._loaded:
            return
        for module in self._modules:
            importlib.import_module(module)
        if self._entry_point_group is not None:
            for entry in entry_points(group=self._entry_point_group):
                entry.load()
        self._loaded = True


NODES = Registry(BUILTIN_NODE_MODULES, ENTRY_POINT_GROUP)
"""The nodes that tree files of this installation may name."""

register_node = NODES.register
registered_nodes = NODES.nodes


def builtin_nodes() -> Mapping[str, type[Node]]:
    """The registered nodes that come with this project, without those of users' packages."""
    return {
        name: node_class
        for name, node_class in registered_nodes().items()
        if node_class.__module__ in BUILTIN_NODE_MODULES
    }


def did_you_mean(name: str, known: Collection[str]) -> str:
    """Second half of a message about the unknown ``name``: similar names, or all of them."""
    by_lower = {candidate.lower(): candidate for candidate in known}
    close = difflib.get_close_matches(name.lower(), by_lower, n=3, cutoff=0.6)
    if close:
        return f"; did you mean {' or '.join(by_lower[match] for match in close)}?"
    return f"; there are: {', '.join(sorted(known)) or 'none'}"


def snake_case(class_name: str) -> str:
    """The default name of a leaf: ``ForceBelowLimit`` gives ``force_below_limit``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", class_name).lower()


def _unfit(node_class: type[Node]) -> str | None:
    """Why ``node_class`` cannot serve as a node, or None."""
    if not _CLASS_NAME.fullmatch(node_class.__name__):
        return "should have a CamelCase name: snake_case ones are kept for composites"
    if getattr(node_class, "role", None) not in get_args(Role):
        return f"needs a role: one of {', '.join(get_args(Role))}"
    if inspect.isabstract(node_class):
        return "has no update(): nothing would happen when it is ticked"
    if not inspect.getdoc(node_class) or inspect.getdoc(node_class) == inspect.getdoc(Node):
        return "needs a docstring: editors show it to whoever writes a tree"
    parameters = node_class.Parameters
    if not issubclass(parameters, BaseModel) or parameters.model_config.get("extra") != "forbid":
        return "has Parameters that are not a pydantic model with extra='forbid'"
    if "name" in parameters.model_fields:
        return "has a parameter 'name': tree files use that key for the node's own name"
    ports = ports_of(node_class)
    if ports and "ports" in parameters.model_fields:
        return "has a parameter 'ports': tree files use that key for the keys of its ports"
    taken = sorted(set(ports) & _NAMES_IN_EVERY_NODE)
    if taken:
        return f"has a port called {taken[0]!r}, as something in every node is called"
    return None
