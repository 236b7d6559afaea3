"""XML of BehaviorTree.CPP 4 as a tree file; what would mean something else here is refused."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from defras_bt.executive.ports import ports_of
from defras_bt.executive.registry import NODES, Registry
from defras_bt.executive.tree_file import tree_from
from defras_bt.executive.tree_kinds import KINDS
from defras_bt.executive.tree_spec import TreeSpec
from defras_bt.interop.groot_kinds import OTHER, kind_of_id
from defras_sim.yaml_source import Fault, InvalidFile, Location, YamlSource

_EXPLICIT = ("Action", "Condition", "Control", "Decorator")
_METADATA = ("_uid", "_fullpath", "_description", "_metric")
_TRUTHS = {"true": True, "false": False, "1": True, "0": False}


@dataclass(frozen=True)
class XmlElement:
    """One element and where it begins; line and column count from 1."""

    tag: str
    attributes: dict[str, str]
    line: int
    column: int
    children: list[XmlElement] = field(default_factory=list)


def import_groot(file: Path, registry: Registry = NODES) -> TreeSpec:
    """Read XML as a tree. Subtrees without ports are put in where they are used.

    Raises:
        InvalidFile: with all of the nodes and attributes that have no counterpart of the same
            meaning, or with what is wrong with the tree.
    """
    root = read_xml(file)
    return _Importer(file, registry).tree(root)


def read_xml(file: Path) -> XmlElement:
    """The elements of an XML file. Text between them is left out.

    Raises:
        InvalidFile: the file cannot be read, is no XML, or declares entities.
    """
    parser = expat.ParserCreate()
    top = XmlElement("", {}, 1, 1)
    open_ones = [top]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        at = (parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        element = XmlElement(tag, attributes, *at)
        open_ones[-1].children.append(element)
        open_ones.append(element)

    def refuse(*_: object) -> None:
        message = "a document type is no part of a behaviour tree; remove it"
        at = (parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        raise InvalidFile([Fault(file, *at, message)])

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _: open_ones.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(file.read_bytes(), True)
    except OSError as error:
        raise InvalidFile([Fault(file, 1, 1, f"cannot be read: {error}")]) from error
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise InvalidFile(
            [Fault(file, error.lineno, error.offset + 1, f"no XML: {what}")]
        ) from error
    return top.children[0]


class _Importer:
    def __init__(self, file: Path, registry: Registry) -> None:
        self._file = file
        self._leaves = registry.nodes()
        self._registry = registry
        self._faults: list[Fault] = []
        self._places: dict[Location, tuple[Path, int, int]] = {(): (file, 1, 1)}
        self._trees: dict[str, XmlElement] = {}

    def tree(self, root: XmlElement) -> TreeSpec:
        main = self._main(root)
        data: dict[str, Any] = {"name": main.attributes.get("ID", "")}
        for key in ("description", "metric"):
            if f"_{key}" in main.attributes:
                data[key] = main.attributes[f"_{key}"]
        self._note((), main)
        self._note(("name",), main)
        top = self._only_child(main)
        data["tree"] = self._node(top, ("tree",), (data["name"],), is_root=True)
        if self._faults:
            raise InvalidFile(self._faults)
        return tree_from(YamlSource(self._file, data, self._places), self._registry)

    def _main(self, root: XmlElement) -> XmlElement:
        """The tree that is run; notes all others as subtrees."""
        if root.tag != "root" or root.attributes.get("BTCPP_format") != "4":
            raise self._stop(root, 'the outermost element should be <root BTCPP_format="4">')
        for element in root.children:
            if element.tag == "BehaviorTree" and "ID" in element.attributes:
                self._trees[element.attributes["ID"]] = element
            elif element.tag != "TreeNodesModel":
                self._fault(element, f"<{element.tag}> is not read: put everything in one file")
        name = root.attributes.get("main_tree_to_execute")
        if name is None and len(self._trees) == 1:
            name = next(iter(self._trees))
        if name is None or name not in self._trees:
            there = ", ".join(self._trees) or "none"
            raise self._stop(root, f"main_tree_to_execute should name a tree; there are: {there}")
        return self._trees[name]

    def _only_child(self, element: XmlElement) -> XmlElement:
        if len(element.children) != 1:
            raise self._stop(
                element, f"<{element.tag}> holds one node, not {len(element.children)}"
            )
        return element.children[0]

    def _node(
        self, element: XmlElement, at: Location, inside: tuple[str, ...], *, is_root: bool = False
    ) -> Any:
        """The node as a tree file would say it."""
        if element.tag == "SubTree":
            return self._subtree(element, at, inside, is_root)
        explicit = element.tag in _EXPLICIT
        identifier = element.attributes.get("ID", "") if explicit else element.tag
        self._note(at, element)
        if identifier in OTHER:
            self._fault(element, f"{identifier} has no counterpart here: {OTHER[identifier]}")
            return identifier
        kind = kind_of_id(identifier)
        at = (*at, kind)
        self._note(at, element)
        body = self._attributes(element, kind, at, explicit, is_root, inside)
        held = KINDS[kind].holds if kind in KINDS else None
        if held == "children":
            below = (*at, held)
            self._note(below, element)
            body[held] = [
                self._node(child, (*below, index), inside)
                for index, child in enumerate(element.children)
            ]
        elif held == "child":
            body[held] = self._node(self._only_child(element), (*at, held), inside)
        elif element.children:
            self._fault(element.children[0], f"{identifier} is a leaf and holds no other nodes")
        return {kind: body}

    def _attributes(
        self,
        element: XmlElement,
        kind: str,
        at: Location,
        explicit: bool,
        is_root: bool,
        inside: tuple[str, ...],
    ) -> dict[str, Any]:
        body: dict[str, Any] = {}
        ports = ports_of(self._leaves[kind]) if kind in self._leaves else {}
        wires: dict[str, Any] = {}
        for name, text in element.attributes.items():
            self._note((*at, name), element)
            if name in _METADATA or (name == "ID" and explicit):
                continue
            if name == "name" and is_root:
                if text != inside[0]:
                    self._fault(
                        element, f"the topmost node is called by the tree's ID ({inside[0]})"
                    )
            elif name.startswith("_"):
                self._fault(element, f"{name}: conditions are nodes of their own here, not scripts")
            elif name in ports:
                self._note((*at, "ports"), element)
                self._note((*at, "ports", name), element)
                key = _pointer(text)
                value = _TRUTHS.get(text, text) if ports[name].kind is bool else text
                wires[name] = key if key is not None else {"value": _typed(value, ports[name].kind)}
            elif _pointer(text) is not None:
                self._fault(element, f"{name}={text!r}: this is a parameter here, not a port")
            else:
                body[name] = _listed(text)
        return body | ({"ports": wires} if wires else {})

    def _subtree(
        self, element: XmlElement, at: Location, inside: tuple[str, ...], is_root: bool
    ) -> Any:
        name = element.attributes.get("ID", "")
        others = [key for key in element.attributes if key not in ("ID", "name", *_METADATA)]
        if others:
            self._fault(element, f"ports of subtrees ({', '.join(others)}) cannot be read here")
        elif name not in self._trees:
            there = ", ".join(self._trees)
            self._fault(element, f"there is no tree {name!r}; there are: {there}")
        elif name in inside:
            self._fault(element, f"the tree {name!r} holds itself")
        else:
            below = self._only_child(self._trees[name])
            return self._node(below, at, (*inside, name), is_root=is_root)
        return name

    def _note(self, at: Location, element: XmlElement) -> None:
        self._places[at] = (self._file, element.line, element.column)

    def _fault(self, element: XmlElement, message: str) -> None:
        self._faults.append(Fault(self._file, element.line, element.column, message))

    def _stop(self, element: XmlElement, message: str) -> InvalidFile:
        self._fault(element, message)
        return InvalidFile(self._faults)


def _pointer(text: str) -> str | None:
    """The key in ``{key}``, None if the text is a value."""
    return text[1:-1] if text.startswith("{") and text.endswith("}") else None


def _typed(value: Any, kind: type) -> Any:
    """The value of a port; one that is none stays text, for the reader to refuse."""
    if isinstance(value, str) and kind in (int, float):
        try:
            return kind(value)
        except ValueError:
            return value
    return value


def _listed(text: str) -> Any:
    """Text, or the list that its semicolons make of it."""
    return text.removesuffix(";").split(";") if ";" in text else text
