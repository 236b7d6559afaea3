"""An independent reader of JSON schemas, for the few words that the trees' schema uses."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from ruamel.yaml import YAML

from defras_bt.executive.node import Node
from defras_bt.executive.tree_schema import tree_schema


def complaints(value: Any, schema: Any, definitions: Any, at: str = "file") -> list[str]:
    """A JSON schema validator for the few words that the schema uses, after the standard's text."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].removeprefix("#/$defs/")]
    if "anyOf" in schema:
        tried = [complaints(value, branch, definitions, at) for branch in schema["anyOf"]]
        return [] if [] in tried else tried[-1]
    if "enum" in schema and value not in schema["enum"]:
        return [f"{at}: not one of {schema['enum']}"]
    kinds = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float)}
    wanted = schema.get("type")
    if wanted in kinds and not isinstance(value, kinds[wanted]):
        return [f"{at}: not {wanted}"]
    found = []
    if isinstance(value, dict):
        known = schema.get("properties", {})
        found += [f"{at}: no {key}" for key in schema.get("required", []) if key not in value]
        if not schema.get("minProperties", 0) <= len(value) <= schema.get("maxProperties", 99):
            found.append(f"{at}: number of keys")
        for key, inside in value.items():
            if key in known:
                found += complaints(inside, known[key], definitions, f"{at}.{key}")
            elif schema.get("additionalProperties") is False:
                found.append(f"{at}: unknown {key}")
            elif isinstance(schema.get("additionalProperties"), dict):
                inner = schema["additionalProperties"]
                found += complaints(inside, inner, definitions, f"{at}.{key}")
    if isinstance(value, list):
        if len(value) < schema.get("minItems", 0):
            found.append(f"{at}: too short")
        for index, item in enumerate(value):
            found += complaints(item, schema.get("items", {}), definitions, f"{at}.{index}")
    if isinstance(value, str) and not re.search(schema.get("pattern", ""), value):
        found.append(f"{at}: pattern")
    if isinstance(value, (int, float)) and (
        value < schema.get("minimum", value) or value <= schema.get("exclusiveMinimum", value - 1)
    ):
        found.append(f"{at}: too small")
    return found


def against_schema(text: str, nodes: Mapping[str, type[Node]]) -> list[str]:
    """What the schema of trees objects to in a file."""
    schema = tree_schema(nodes)
    return complaints(YAML(typ="safe", pure=True).load(text), schema, schema["$defs"])
