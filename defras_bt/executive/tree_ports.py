"""Ports in tree files: which key each one stands under, and whether types and directions agree.

Keys are private to a file: two inclusions of one file share nothing. A file hands values in and out
through ports of its own, declared at its top with their types; whoever includes it says which of
its own keys they lead to, or gives a value::

    name: hold
    ports:
      wanted_n: {type: number, direction: in, description: Force to hold.}
    tree:
      HoldTension                       # reads the key wanted_n

    - subtree: {file: hold.yaml, ports: {wanted_n: left_tension}}
    - subtree: {file: hold.yaml, ports: {wanted_n: 0.3}}
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from pydantic import Field

from defras_bt.executive.node import NodeParameters
from defras_bt.executive.ports import Port, Reads, WrongPortValue, ports_of
from defras_bt.executive.registry import did_you_mean
from defras_bt.executive.tree_spec import NodeSpec, Place, Scope, TreeSpec, Wire
from defras_sim.yaml_source import Fault

SCALARS: dict[str, type] = {"number": float, "integer": int, "boolean": bool, "text": str}
"""Types whose values a tree file can write down."""


class PortDeclaration(NodeParameters):
    """A port of a tree file."""

    type: str = Field(description="number, integer, boolean, text, or the type of a leaf's port.")
    direction: Literal["in", "out"] = Field(description="in: given by whoever includes the file.")
    default: bool | int | float | str | None = Field(
        default=None, description="Value of a port that is not given."
    )
    description: str = Field(default="", description="What it means, with its unit.")


@dataclass(frozen=True)
class Use:
    """One place at which a key is read, written or asked about."""

    key: str
    type_name: str | None
    direction: Literal["in", "out", "asked"]
    place: Place
    who: str


@dataclass(frozen=True)
class _Surroundings:
    """The file that a node stands in: where its declared ports lead, and the prefix of the rest."""

    prefix: str
    leads: Mapping[str, str]
    inward: frozenset[str] = frozenset()

    def key(self, name: str) -> str:
        return self.leads.get(name, f"{self.prefix}{name}")


@dataclass
class Wiring:
    """Finds the key of every port of a tree; what is wrong is added to ``faults``.

    ``values`` are those given in files, by key; ``needed`` the keys that only somebody who includes
    the whole tree can fill.
    """

    faults: list[Fault]
    values: dict[str, Any] = field(default_factory=dict)
    needed: dict[str, Place] = field(default_factory=dict)
    uses: list[Use] = field(default_factory=list)
    declared: list[tuple[Place, str]] = field(default_factory=list)

    def wired(self, tree: TreeSpec) -> TreeSpec:
        """The tree with the keys of every port."""
        root = self._node(tree.root, tree.root.name, _Surroundings("", {}))
        self._know_types(root)
        self._compare_types()
        return replace(tree, root=root, values=self.values, needs=self.needed)

    def _node(self, spec: NodeSpec, path: str, here: _Surroundings) -> NodeSpec:
        for depth, scope in enumerate(spec.scopes, 1):
            # A file that only includes another has its topmost node in common with it, but no keys.
            prefix = "" if scope.given is None else path + "/" * depth
            here = self._enter(scope, prefix, here)
        children = tuple(self._node(c, f"{path}/{c.name}", here) for c in spec.children)
        keys = {}
        if spec.node_class is not None:
            for name, port in ports_of(spec.node_class).items():
                keys[name] = self._key(spec, path, name, port, here)
        return replace(spec, children=children, keys=keys)

    def _key(
        self, spec: NodeSpec, path: str, name: str, port: Port[Any], here: _Surroundings
    ) -> str:
        wire = spec.wires.get(name, Wire(spec.place, key=name))
        who = f"{spec.kind} {path}"
        if wire.key is None:
            if not isinstance(port, Reads):
                self._fault(wire.place, f"{who} does not read port {name!r}: give it a key")
            self._value(f"{path}:{name}", wire, port)
            return f"{path}:{name}"
        if port.direction == "out" and wire.key in here.inward:
            self._fault(
                wire.place,
                f"{who} writes {wire.key!r}, a port of this file that is declared `in`; "
                "declare it `out`, or write under another key",
            )
        key = here.key(wire.key)
        type_name = None if port.direction == "asked" else port.type_name
        self.uses.append(Use(key, type_name, port.direction, wire.place, who))
        return key

    def _enter(self, scope: Scope, prefix: str, outer: _Surroundings) -> _Surroundings:
        """The surroundings inside a file, once its declared ports are led outside."""
        leads = {}
        given = scope.given or {}
        for name, said in given.items():
            if name not in scope.declared:
                known = did_you_mean(name, scope.declared)
                self._fault(said.place, f"{scope.file.name} has no port {name!r}{known}")
        for name, (place, port) in scope.declared.items():
            wire = given.get(name)
            if wire is None and port.default is not None:
                wire = Wire(place, value=port.default)
            leads[name] = f"{prefix}{name}"
            if wire is None:
                self._not_given(scope, name, leads[name])
            elif wire.key is None:
                self._given_value(leads[name], wire, name, port)
            else:
                leads[name] = outer.key(wire.key)
                if port.direction == "out" and wire.key in outer.inward:
                    self._fault(wire.place, f"{wire.key!r} is declared `in` and is written here")
            self.declared.append((place, port.type))
            who = f"{scope.file.name}, port {name!r},"
            self.uses.append(Use(leads[name], port.type, "in", wire.place if wire else place, who))
        inward = frozenset(n for n, (_, port) in scope.declared.items() if port.direction == "in")
        return _Surroundings(prefix, leads, inward)

    def _not_given(self, scope: Scope, name: str, key: str) -> None:
        """Where a file is included, its ``in`` ports are given; else they are still needed."""
        place, port = scope.declared[name]
        if port.direction == "in" and scope.given is None:
            self.needed[key] = place
        elif port.direction == "in":
            self._fault(
                scope.place,
                f"{scope.file.name} needs its port {name!r} ({port.type}): give it a key or a "
                f"value, as in `ports: {{{name}: some_key}}`",
            )

    def _given_value(self, key: str, wire: Wire, name: str, port: PortDeclaration) -> None:
        if port.direction == "out" or port.type not in SCALARS:
            self._fault(
                wire.place,
                f"port {name!r} ({port.direction}, {port.type}) takes a key, not a value",
            )
            return
        taking: Port[Any] = Port(SCALARS[port.type], port.description)
        taking.name = name
        self._value(key, wire, taking)

    def _value(self, key: str, wire: Wire, port: Port[Any]) -> None:
        try:
            self.values[key] = port.checked(wire.value)
        except WrongPortValue as error:
            self._fault(wire.place, str(error))

    def _know_types(self, root: NodeSpec) -> None:
        """Declared types are those of leaves' ports, or can be written down."""
        known = set(SCALARS)
        for _, spec in root.walk():
            ports = ports_of(spec.node_class) if spec.node_class is not None else {}
            known |= {port.type_name for port in ports.values() if port.direction != "asked"}
        for place, type_name in self.declared:
            if type_name not in known:
                self._fault(
                    place, f"there is no type {type_name!r}{did_you_mean(type_name, known)}"
                )

    def _compare_types(self) -> None:
        first: dict[str, Use] = {}
        for use in self.uses:
            if use.type_name is None:
                continue
            known = first.setdefault(use.key, use)
            if known.type_name != use.type_name:
                self._fault(
                    use.place,
                    f"{use.who} takes a {use.type_name} under the key {use.key!r}, where "
                    f"{known.who} has a {known.type_name} (line {known.place[1]})",
                )

    def _fault(self, place: Place, message: str) -> None:
        self.faults.append(Fault(*place, message))
