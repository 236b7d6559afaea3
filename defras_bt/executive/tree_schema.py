"""JSON schema of tree files, made from the registered node classes: completion in editors.

``python -m defras_bt.executive.tree_schema`` rewrites trees/schema.json.
"""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from defras_bt.executive.node import Node
from defras_bt.executive.ports import Port, ports_of
from defras_bt.executive.registry import builtin_nodes
from defras_bt.executive.tree_fields import NAME_PATTERN
from defras_bt.executive.tree_header import SUBTREE, SubtreeOptions, TreeHeader
from defras_bt.executive.tree_kinds import KINDS
from defras_sim.resources import resource

SCHEMA_LINE = "# yaml-language-server: $schema=schema.json"
"""First line of every tree file beside the schema."""

Schema = dict[str, Any]

_NODE_REF = {"$ref": "#/$defs/node"}
_WIRE: Schema = {
    "anyOf": [
        {"type": "string", "pattern": NAME_PATTERN, "description": "A key."},
        {"type": "boolean"},
        {"type": "number"},
        {
            "type": "object",
            "required": ["value"],
            "additionalProperties": False,
            "properties": {"value": {}},
        },
    ],
}
_NAME: Schema = {"type": "string", "pattern": NAME_PATTERN, "description": "Part of its path."}


def tree_schema(nodes: Mapping[str, type[Node]]) -> Schema:
    """JSON schema of a tree file that may use ``nodes`` as leaves.

    A node is a string or a mapping with one key. The keys stand side by side in one schema, rather
    than as alternatives, because editors then offer them all and report one error, not one each.
    """
    definitions: dict[str, Schema] = {}
    kinds: dict[str, Schema] = {}
    for kind in KINDS.values():
        body = _body(kind.name, kind.options, kind.description, definitions)
        if kind.holds == "children":
            body["properties"]["children"] = {"type": "array", "minItems": 1, "items": _NODE_REF}
        elif kind.holds == "child":
            body["properties"]["child"] = _NODE_REF
        if kind.holds is not None:
            body["required"] = [kind.holds, *body.get("required", [])]
        kinds[kind.name] = body
    kinds[SUBTREE] = _body(SUBTREE, SubtreeOptions, "The tree of another file.", definitions)
    kinds[SUBTREE]["properties"]["ports"] = {"type": "object", "additionalProperties": _WIRE}
    for name, node_class in nodes.items():
        description = f"{inspect.getdoc(node_class)}\n\nRole: {node_class.role}."
        kinds[name] = _body(name, node_class.Parameters, description, definitions)
        ports = ports_of(node_class)
        if ports:
            kinds[name]["properties"]["ports"] = _ports(ports)
    header = TreeHeader.model_json_schema()
    definitions.update(header.pop("$defs"))
    header["properties"]["tree"] = {**_NODE_REF, "description": "The topmost node."}
    definitions["node"] = {
        "anyOf": [
            {"enum": [name for name, body in kinds.items() if not body.get("required")]},
            {
                "type": "object",
                "minProperties": 1,
                "maxProperties": 1,
                "additionalProperties": False,
                "properties": {name: {"$ref": f"#/$defs/{name}"} for name in kinds},
            },
        ]
    }
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        **header,
        "title": "Behaviour tree",
        "$defs": {**definitions, **kinds},
    }


def _ports(ports: Mapping[str, Port[Any]]) -> Schema:
    """Schema of what stands under ``ports`` of a leaf."""
    said = {
        name: {**_WIRE, "description": f"{port.direction}, {port.type_name}. {port.description}"}
        for name, port in ports.items()
    }
    return {"type": "object", "additionalProperties": False, "properties": said}


def schema_text(nodes: Mapping[str, type[Node]]) -> str:
    """The schema as it stands in a file."""
    return json.dumps(tree_schema(nodes), indent=2, ensure_ascii=False) + "\n"


def _body(
    kind: str, options: type[BaseModel], description: str, definitions: dict[str, Schema]
) -> Schema:
    """Schema of what stands under ``kind``; models used in its options go to ``definitions``."""
    body = options.model_json_schema(ref_template=f"#/$defs/{kind}.{{model}}")
    for name, definition in body.pop("$defs", {}).items():
        definitions[f"{kind}.{name}"] = definition
    # The description of a parameter model is part of the node's, not of the mapping in the file.
    body["title"], body["description"] = kind, description
    body["properties"] = {"name": _NAME, **body.get("properties", {})}
    return body


def main(arguments: list[str]) -> None:
    """Write the schema of the built-in nodes to trees/schema.json, or to the file named."""
    file = Path(arguments[0]) if arguments else resource("trees") / "schema.json"
    file.write_text(schema_text(builtin_nodes()), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
