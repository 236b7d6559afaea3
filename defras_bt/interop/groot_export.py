"""A tree as XML of BehaviorTree.CPP 4, which Groot2 opens."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from ruamel.yaml import YAML

from defras_bt.executive.node import Node
from defras_bt.executive.ports import Port, ports_of
from defras_bt.executive.registry import snake_case
from defras_bt.executive.tree_dump import dump_tree
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import TreeSpec
from defras_bt.interop.groot_kinds import SAME, groot_id

Annotate = Callable[[str, Element], None]
"""Called with path and element of every node, parents first."""


class CannotExport(ValueError):
    """Something in the tree has no counterpart in XML; says what."""


def groot_xml(
    tree: TreeSpec,
    leaves: Mapping[str, type[Node]],
    annotate: Annotate = lambda path, element: None,
    *,
    with_builtins: bool = False,
) -> str:
    """The whole tree, its includes put in, with a model of every node in it.

    ``leaves``: the registered leaf classes by name. ``with_builtins``: with models of the nodes of
    BehaviorTree.CPP, too, as its log files have them.

    Raises:
        CannotExport: a value has no counterpart.
    """
    if tree.needs:
        raise CannotExport(
            f"{tree.name} takes ports from the tree that includes it ({', '.join(tree.needs)}); "
            "export that one"
        )
    data = YAML(typ="safe", pure=True).load(dump_tree(tree))
    root = Element("root", BTCPP_format="4", main_tree_to_execute=tree.name)
    top = SubElement(root, "BehaviorTree", ID=tree.name, _fullpath="")
    if tree.description:
        top.set("_description", tree.description)
    if tree.metric is not None:
        top.set("_metric", tree.metric)
    _add(top, data["tree"], tree.name, "", leaves, annotate)
    used = [element for element in top.iter() if element is not top]
    models = SubElement(root, "TreeNodesModel")
    for model in _models(used, leaves, with_builtins):
        models.append(model)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _add(
    above: Element,
    data: Any,
    called: str | None,
    above_path: str,
    leaves: Mapping[str, type[Node]],
    annotate: Annotate,
) -> None:
    kind, body = (data, {}) if isinstance(data, str) else next(iter(data.items()))
    usual = snake_case(kind) if kind in leaves else kind
    name = called or body.get("name", usual)
    element = SubElement(above, groot_id(kind), name=name)
    path = f"{above_path}{name}"
    held = KINDS[kind].holds if kind in KINDS else None
    for key, value in body.items():
        if key == "ports":
            for port, wire in value.items():
                element.set(port, _wired(wire, path))
        elif key not in ("name", held):
            element.set(key, _text(value, f"{path}.{key}"))
    if kind in leaves:
        for port in ports_of(leaves[kind]):
            if port not in element.attrib:
                element.set(port, f"{{{port}}}")
    annotate(path, element)
    children = [] if held is None else body[held] if held == "children" else [body[held]]
    for child in children:
        _add(element, child, None, f"{path}/", leaves, annotate)


def _wired(wire: Any, path: str) -> str:
    return _text(wire["value"], path) if isinstance(wire, dict) else f"{{{wire}}}"


def _text(value: Any, where: str) -> str:
    """A value as BehaviorTree.CPP reads it. A semicolon separates, and marks a list of one."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, list) and not any(isinstance(item, (dict, list)) for item in value):
        parts = [_text(item, where) for item in value]
        if not any(";" in part for part in parts):
            return f"{parts[0]};" if len(parts) == 1 else ";".join(parts)
    elif isinstance(value, str) and not value.startswith("{") and ";" not in value:
        return value
    raise CannotExport(f"{where}: {value!r} has no counterpart in an attribute of XML")


def _models(
    used: Sequence[Element], leaves: Mapping[str, type[Node]], with_builtins: bool
) -> list[Element]:
    models = []
    kinds = {groot_id(kind): kind for kind in KINDS}
    holding = {element.tag for element in used if len(element)}
    for identifier in sorted({element.tag for element in used}):
        if identifier in leaves:
            models.append(_leaf_model(identifier, leaves[identifier]))
        elif identifier in kinds and (with_builtins or kinds[identifier] not in SAME):
            models.append(_kind_model(identifier, kinds[identifier], identifier in holding))
        elif identifier not in kinds:
            models.append(Element("Action", ID=identifier))
    return models


def _leaf_model(identifier: str, leaf: type[Node]) -> Element:
    model = Element("Condition" if leaf.role == "guard" else "Action", ID=identifier)
    _add_options(model, leaf.Parameters)
    for name, port in ports_of(leaf).items():
        _add_port(model, name, port)
    SubElement(model, "description").text = (leaf.__doc__ or "").strip().partition("\n")[0]
    return model


def _kind_model(identifier: str, kind: str, holding: bool) -> Element:
    """``holding``: it has children. A control node without any is refused by BehaviorTree.CPP."""
    known = KINDS[kind]
    tag = "Decorator" if known.holds == "child" else "Control" if holding else "Action"
    model = Element(tag, ID=identifier)
    _add_options(model, known.options)
    SubElement(model, "description").text = known.description
    return model


def _add_options(model: Element, options: type[BaseModel]) -> None:
    for name, option in options.model_fields.items():
        port = SubElement(model, "input_port", name=name)
        if option.default is not PydanticUndefined and option.default is not None:
            default = option.default
            port.set("default", _text(list(default) if isinstance(default, tuple) else default, ""))
        port.text = option.description


def _add_port(model: Element, name: str, port: Port[Any]) -> None:
    tag = "output_port" if port.direction == "out" else "input_port"
    kind = {float: "double", bool: "bool", int: "int"}.get(port.kind, "std::string")
    SubElement(model, tag, name=name, type=kind).text = port.description
