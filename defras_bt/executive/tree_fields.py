"""Names and options of the nodes in a YAML file, checked one node at a time."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from defras_bt.executive.registry import did_you_mean
from defras_bt.executive.tree_spec import Place, Wire
from defras_sim.yaml_source import Fault, Location, YamlSource

Model = TypeVar("Model", bound=BaseModel)

NAME_PATTERN = r"^[a-z0-9][a-z0-9_]*$"
"""What a node or tree may be called: part of a path, so no "/"."""


@dataclass(frozen=True)
class FieldChecker:
    """Checks parts of one YAML file; what is wrong is added to ``faults``."""

    source: YamlSource
    faults: list[Fault]

    def name(self, at: Location, kind: str, body: Mapping[Any, Any], default: str) -> str | None:
        """What the node is called; None after noting that the given name cannot be."""
        name = body.get("name", default)
        if "name" in body and not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
            self.fault(
                (*at, "name"),
                f"{kind}.name: a name has small letters, digits and _, not {name!r}",
            )
            return None
        return str(name)

    def wires(self, at: Location, kind: str, body: Mapping[Any, Any]) -> dict[str, Wire] | None:
        """What stands under ``ports``: a key or a value for each; None after noting a fault."""
        given = body.get("ports", {})
        if not isinstance(given, dict):
            self.fault((*at, "ports"), f"{kind}.ports: should be keys and values, not {given!r}")
            return None
        wires = {}
        for port, said in given.items():
            where = (*at, "ports", port)
            if isinstance(said, str) and re.fullmatch(NAME_PATTERN, said):
                wires[str(port)] = Wire(self.place(where), key=said)
            elif isinstance(said, (bool, int, float)):
                wires[str(port)] = Wire(self.place(where), value=said)
            elif isinstance(said, dict) and list(said) == ["value"]:
                wires[str(port)] = Wire(self.place(where), value=said["value"])
            else:
                self.fault(
                    where,
                    f"{kind}.ports.{port}: give a key (small letters, digits and _), a number, or "
                    f"{{value: ...}}, not {said!r}",
                )
        return wires if len(wires) == len(given) else None

    def checked(
        self,
        at: Location,
        values: Mapping[Any, Any],
        model: type[Model],
        label: str,
        other_keys: tuple[str, ...] = (),
    ) -> Model | None:
        """``values`` without the ``other_keys`` as ``model``; None after noting what is wrong.

        ``label`` names the node in messages. An unknown key is answered by what would be valid.
        """
        known = (*model.model_fields, *other_keys)
        before = len(self.faults)
        for key in values:
            if key not in known:
                hint = did_you_mean(str(key), known)
                self.fault((*at, key), f"{label} has no key {key!r}{hint}")
        fields = {key: value for key, value in values.items() if key in model.model_fields}
        try:
            options = model.model_validate(fields)
        except ValidationError as error:
            for item in error.errors():
                where = ".".join((label, *map(str, item["loc"])))
                given = item["input"]
                got = "" if isinstance(given, (dict, list, BaseModel)) else f" (got {given!r})"
                message = item["msg"].removeprefix("Value error, ")
                self.fault((*at, *item["loc"]), f"{where}: {message}{got}")
            return None
        return options if len(self.faults) == before else None

    def place(self, at: Location) -> Place:
        """File, line and column at which ``at`` stands."""
        fault = self.source.fault(at, "")
        return fault.file, fault.line, fault.column

    def fault(self, at: Location, message: str) -> None:
        """Note what is wrong at ``at``."""
        self.faults.append(self.source.fault(at, message))
