"""The schema that editors use is current and says the same as the reader."""

import json
import re
from typing import Literal

import pytest
from pydantic import BaseModel, Field

from defras_bt.executive.node import Node, NodeParameters
from defras_bt.executive.registry import Registry, builtin_nodes
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_schema import SCHEMA_LINE, main, schema_text, tree_schema
from defras_sim.resources import resource
from defras_sim.yaml_source import InvalidFile
from tests.executive.json_schema import against_schema

TREES = sorted(resource("trees").glob("*.yaml"))


def test_the_schema_beside_the_trees_is_current():
    """Run ``python -m defras_bt.executive.tree_schema`` after a change of nodes."""
    shipped = (resource("trees") / "schema.json").read_text(encoding="utf-8")
    assert shipped == schema_text(builtin_nodes())


def test_main_writes_the_file_it_is_given(tmp_path):
    main([str(tmp_path / "schema.json")])
    assert (tmp_path / "schema.json").read_text(encoding="utf-8") == schema_text(builtin_nodes())


@pytest.mark.parametrize("file", TREES, ids=lambda file: file.name)
def test_the_trees_name_the_schema_and_meet_it(file):
    text = file.read_text(encoding="utf-8")
    assert text.splitlines()[0] == SCHEMA_LINE
    assert against_schema(text, builtin_nodes()) == []


def test_every_reference_has_a_definition():
    text = schema_text(builtin_nodes())
    references = set(re.findall(r'"#/\$defs/([^"]+)"', text))
    definitions = json.loads(text)["$defs"]
    assert references <= set(definitions)
    assert set(definitions) >= {"node", "subtree", *KINDS, *builtin_nodes()}


@pytest.mark.parametrize(
    "node",
    [
        "Think",
        "Limit",
        "Thing",
        "{Limit: {limit_n: 1}}",
        "{Limit: {limit_n: 0}}",
        "{Limit: {limit_n: x}}",
        "{Limit: {limit_n: 1, limit: 2}}",
        "{Limit: {limit_n: 1}, name: x}",
        "{sequence: {children: [Think]}}",
        "{sequence: {children: []}}",
        "{sequence: {child: Think}}",
        "{sequence: {name: X, children: [Think]}}",
        "{invert: {child: Think}}",
        "{invert: {child: [Think]}}",
        "{invert: {}}",
        "invert",
        "{retry: {attempts: 0, child: Think}}",
        "{parallel: {children: [Think]}}",
        "{parallel: {succeed_when: two, children: [Think]}}",
        "{subtree: {file: notes.txt}}",
        "[Think]",
        "{}",
        "{Think: }",
    ],
)
def test_schema_and_reader_agree(node, write_tree, toys):
    text = f"name: toy\ntree: {{selector: {{children: [{node}]}}}}\n"
    try:
        read_tree(write_tree(text), toys.registry)
        is_read = True
    except InvalidFile:
        is_read = False
    assert (against_schema(text, toys.registry.nodes()) == []) == is_read


class Target(BaseModel):
    x_m: float


class NestedParameters(NodeParameters):
    targets: list[Target] = Field(min_length=1)
    arm: Literal["psm1", "psm2"] = "psm1"


class Nested(Node):
    """Has parameters with a model inside."""

    role = "task"
    Parameters = NestedParameters

    def update(self):
        return self.succeed("done", "done")


def test_models_inside_parameters_are_defined_once_per_node():
    registry = Registry()
    registry.register(Nested)
    schema = tree_schema(registry.nodes())
    items = schema["$defs"]["Nested"]["properties"]["targets"]["items"]
    assert items == {"$ref": "#/$defs/Nested.Target"}
    assert schema["$defs"]["Nested.Target"]["required"] == ["x_m"]
    assert "$defs" not in schema["$defs"]["Nested"]
    assert "Role: task." in schema["$defs"]["Nested"]["description"]
