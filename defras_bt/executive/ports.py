"""Ports: typed values that leaves hand to each other under keys that a tree file chooses.

A leaf class declares its ports; a tree file says under which keys they meet::

    class MeasureTension(Node):
        tension_n = Writes(float, "Force along the fold [N].")

        def update(self) -> Status:
            self.tension_n = ...

    class HoldTension(Node):
        wanted_n = Reads(float, "Force to hold [N].")

    # - MeasureTension
    # - HoldTension: {ports: {wanted_n: tension_n}}

Values live on the blackboard of one executive; nothing is shared between executives.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, TypeVar, overload

if TYPE_CHECKING:
    from defras_bt.executive.node import Node

T = TypeVar("T")

_SPOKEN: dict[type, str] = {float: "number", int: "integer", bool: "boolean", str: "text"}
_UNSET: Any = object()


class PortUnset(LookupError):
    """A port was read before anything was written under its key."""


class WrongPortValue(TypeError):
    """A value does not have the type of its port."""


class PortValues:
    """The values under the keys of one tree. One instance per executive."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def read(self, key: str) -> Any:
        """The value under ``key``.

        Raises:
            PortUnset: there is none yet.
        """
        if key not in self._values:
            written = ", ".join(sorted(self._values)) or "none"
            raise PortUnset(f"nothing was written under {key!r}; keys with a value: {written}")
        return self._values[key]

    def write(self, key: str, value: Any) -> None:
        """Put ``value`` under ``key``, in place of what was there."""
        self._values[key] = value


class Port(Generic[T]):
    """One port of a leaf class: its type, and what it is for."""

    direction: ClassVar[Literal["in", "out", "asked"]]

    def __init__(self, kind: type[T], description: str) -> None:
        self.kind = kind
        self.description = description
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @property
    def type_name(self) -> str:
        """How tree files call the type: number, integer, boolean, text, or the name of a class."""
        return type_name(self.kind)

    def checked(self, value: Any) -> T:
        """``value`` as this port takes it.

        Raises:
            WrongPortValue: it is of another type, or no finite number.
        """
        if self.kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        is_bool = isinstance(value, bool) and self.kind is not bool and self.kind is not object
        if is_bool or not isinstance(value, self.kind):
            raise WrongPortValue(f"port {self.name!r} takes a {self.type_name}, not {value!r}")
        if isinstance(value, float) and not isfinite(value):
            raise WrongPortValue(f"port {self.name!r} takes a finite number, not {value!r}")
        return value


class Reads(Port[T]):
    """A port that a leaf reads. With a ``default`` nothing need have been written."""

    direction = "in"

    def __init__(self, kind: type[T], description: str, *, default: T = _UNSET) -> None:
        super().__init__(kind, description)
        self._default = default

    @property
    def has_default(self) -> bool:
        return self._default is not _UNSET

    @overload
    def __get__(self, node: None, owner: type) -> Reads[T]: ...
    @overload
    def __get__(self, node: Node, owner: type) -> T: ...
    def __get__(self, node: Node | None, owner: type) -> Reads[T] | T:
        if node is None:
            return self
        values, key = node.context.board.ports, node.keys[self.name]
        if self.has_default and key not in values:
            return self._default
        return self.checked(values.read(key))


class Writes(Port[T]):
    """A port that a leaf writes: whenever it succeeds, something was written."""

    direction = "out"

    @overload
    def __get__(self, node: None, owner: type) -> Writes[T]: ...
    @overload
    def __get__(self, node: Node, owner: type) -> T: ...
    def __get__(self, node: Node | None, owner: type) -> Writes[T] | T:
        if node is None:
            return self
        return self.checked(node.context.board.ports.read(node.keys[self.name]))

    def __set__(self, node: Node, value: T) -> None:
        node.context.board.ports.write(node.keys[self.name], self.checked(value))


class Asks(Port[object]):
    """A port of which a leaf asks whether there is a value; it succeeds only if there is."""

    direction = "asked"

    def __init__(self, description: str) -> None:
        super().__init__(object, description)

    @overload
    def __get__(self, node: None, owner: type) -> Asks: ...
    @overload
    def __get__(self, node: Node, owner: type) -> bool: ...
    def __get__(self, node: Node | None, owner: type) -> Asks | bool:
        if node is None:
            return self
        return node.keys[self.name] in node.context.board.ports


def type_name(kind: type) -> str:
    """How tree files call a type."""
    return _SPOKEN.get(kind, kind.__name__)


def ports_of(node_class: type) -> Mapping[str, Port[Any]]:
    """The ports of a leaf class by name, those of its base classes included."""
    found: dict[str, Port[Any]] = {}
    for base in reversed(node_class.__mro__):
        found.update({name: port for name, port in vars(base).items() if isinstance(port, Port)})
    return found
