"""A tree as the text of one file: its includes put in, nothing left out that matters."""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import StringIO
from typing import Any

from ruamel.yaml import YAML

from defras_bt.executive.registry import snake_case
from defras_bt.executive.tree_fields import NAME_PATTERN
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import NodeSpec, TreeSpec


def dump_tree(tree: TreeSpec) -> str:
    """YAML that reads as a tree of the same meaning.

    Keys that were private to an included file are renamed where they would collide. Ports that a
    tree needs from whoever includes it stay ports.
    """
    data: dict[str, Any] = {"name": tree.name}
    if tree.description:
        data["description"] = tree.description
    if tree.metric is not None:
        data["metric"] = tree.metric
    ports = _ports_needed(tree)
    if ports:
        data["ports"] = ports
    data["tree"] = _node(tree.root, tree, _names(tree), is_root=True)
    stream = StringIO()
    # What has no mapping or list inside stands on one line.
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style, yaml.sort_base_mapping_type_on_output = None, False
    yaml.dump(data, stream)
    return stream.getvalue()


def _ports_needed(tree: TreeSpec) -> dict[str, Any]:
    if not tree.needs or not tree.root.scopes:
        return {}
    declared = tree.root.scopes[0].declared
    return {key: declared[key][1].model_dump(exclude_defaults=True) for key in tree.needs}


def _names(tree: TreeSpec) -> dict[str, str]:
    """A name that a file may use for every key of the whole tree."""
    names: dict[str, str] = {key: key for key in tree.needs}
    for _, spec in tree.root.walk():
        for key in spec.keys.values():
            if key in names or key in tree.values:
                continue
            name = key if re.fullmatch(NAME_PATTERN, key) else re.sub(r"[^a-z0-9_]", "_", key)
            while name in names.values():
                name += "_"
            names[key] = name
    return names


def _node(spec: NodeSpec, tree: TreeSpec, names: Mapping[str, str], *, is_root: bool) -> Any:
    body: dict[str, Any] = {}
    usual = snake_case(spec.kind) if spec.node_class is not None else spec.kind
    if not is_root and spec.name != usual:
        body["name"] = spec.name
    body.update(spec.options.model_dump(mode="json", exclude_defaults=True))
    ports = {port: _wire(key, tree, names) for port, key in spec.keys.items()}
    ports = {port: said for port, said in ports.items() if said != port}
    if ports:
        body["ports"] = ports
    children = [_node(child, tree, names, is_root=False) for child in spec.children]
    holds = KINDS[spec.kind].holds if spec.node_class is None else None
    if holds == "children":
        body["children"] = children
    elif holds == "child":
        (body["child"],) = children
    return {spec.kind: body} if body else spec.kind


def _wire(key: str, tree: TreeSpec, names: Mapping[str, str]) -> Any:
    return {"value": tree.values[key]} if key in tree.values else names[key]
