"""YAML files checked against pydantic models: all faults at once, as file:line:column."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from defras_sim.yaml_aliases import alias_fault

Location = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)

_UNREADABLE = (YAMLError, ValueError, RecursionError)
_MALFORMED_TAG = (AttributeError, KeyError, IndexError, TypeError)
"""What ruamel trips over where the value does not suit an explicit tag, as in `!!int ""`."""


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a file, and what would be valid. Line and column count from 1."""

    file: Path
    line: int
    column: int
    message: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}: {self.message}"


class InvalidFile(ValueError):
    """A file that cannot be used; ``faults`` lists everything that is wrong with it."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


@dataclass(frozen=True)
class YamlSource:
    """Plain data of a YAML file and the place (file, line, column) where each node stands."""

    file: Path
    data: Any
    places: Mapping[Location, tuple[Path, int, int]]

    def fault(self, location: Sequence[str | int], message: str) -> Fault:
        """A fault at ``location``, or at its nearest ancestor that stands in the file."""
        where = tuple(location)
        while where and where not in self.places:
            where = where[:-1]
        return Fault(*self.places.get(where, (self.file, 1, 1)), message)

    def validate(self, model: type[Model], context: Mapping[str, Any] | None = None) -> Model:
        """Check the data against ``model``, which may look into ``context``.

        Raises:
            InvalidFile: with one fault for each thing pydantic objects to.
        """
        try:
            return model.model_validate(self.data, context=context)
        except ValidationError as error:
            raise InvalidFile(
                self.fault(item["loc"], _worded(model, item)) for item in error.errors()
            ) from error


def read_yaml(file: Path) -> YamlSource:
    """Read a YAML 1.2 file.

    Raises:
        InvalidFile: the file cannot be read, is not UTF-8, is not YAML, is not a mapping, or has
            aliases that stand for too much.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile([Fault(file, 1, 1, f"cannot be read: {error}")]) from error
    try:
        # Most files have no alias, and need not be parsed twice.
        too_much = alias_fault(text) if "*" in text else None
        document = None if too_much else YAML(typ="rt", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        message = f"not valid YAML: {error.problem or error.context}"
        raise InvalidFile([Fault(file, line, column, message)]) from error
    except (*_UNREADABLE, *_MALFORMED_TAG) as error:
        raise InvalidFile([Fault(file, 1, 1, f"not valid YAML: {error}")]) from error
    if too_much is not None:
        raise InvalidFile([Fault(file, too_much.line, too_much.column, too_much.message)])
    if not isinstance(document, CommentedMap):
        raise InvalidFile([Fault(file, 1, 1, "should hold a mapping of keys to values at the top")])
    places: dict[Location, tuple[Path, int, int]] = {(): (file, 1, 1)}
    data = _collect(document, (), file, places)
    return YamlSource(file, data, places)


def read_extended(file: Path) -> YamlSource:
    """Read a file; with ``extends: other.yaml`` it is laid over the other one in the same folder.

    Raises:
        InvalidFile: a file cannot be read, or extends nothing that is there, or itself.
    """
    return _read_extended(file, ())


def _read_extended(file: Path, seen: tuple[Path, ...]) -> YamlSource:
    source = read_yaml(file)
    if "extends" not in source.data:
        return source
    base = source.data.pop("extends")
    if not isinstance(base, str):
        raise InvalidFile([source.fault(("extends",), "extends: should name a scene file")])
    target = (file.parent / base).resolve()
    if target in seen or target == file.resolve():
        raise InvalidFile([source.fault(("extends",), f"extends: {base} extends itself")])
    if not target.is_file():
        raise InvalidFile([source.fault(("extends",), f"extends: no scene file {base} beside it")])
    return overlay(_read_extended(target, (*seen, file.resolve())), source)


def overlay(base: YamlSource, top: YamlSource) -> YamlSource:
    """``base`` with the mappings of ``top`` laid over it, key by key; lists are replaced whole."""
    places = {key: place for key, place in base.places.items() if not _replaced(key, top.data)}
    return YamlSource(top.file, _merge(base.data, top.data), {**places, **top.places})


def _merge(base: Any, top: Any) -> Any:
    if isinstance(base, dict) and isinstance(top, dict):
        return {**base, **{key: _merge(base.get(key), value) for key, value in top.items()}}
    return top


def _replaced(key: Location, top: Any) -> bool:
    """Whether ``key`` of the base lies at or under something that the top file replaces."""
    for part in key:
        if not isinstance(top, dict) or part not in top:
            return not isinstance(top, dict)
        top = top[part]
    return not isinstance(top, dict)


def _collect(node: Any, where: Location, file: Path, places: dict[Location, Any]) -> Any:
    if isinstance(node, CommentedMap):
        for key in node:
            places[(*where, key)] = (file, *_position(node, node.lc.key, key))
        return {key: _collect(value, (*where, key), file, places) for key, value in node.items()}
    if isinstance(node, CommentedSeq):
        for index in range(len(node)):
            places[(*where, index)] = (file, *_position(node, node.lc.item, index))
        return [_collect(item, (*where, i), file, places) for i, item in enumerate(node)]
    # ruamel's scalar subclasses (positions, quoting) become plain Python values.
    for plain in (bool, int, float, str):
        if isinstance(node, plain):
            return plain(node)
    return node


def _position(
    node: CommentedMap | CommentedSeq, find: Callable[[Any], tuple[int, int]], key: Any
) -> tuple[int, int]:
    """Line and column of an entry; of the whole node where the entry was merged in by `<<`."""
    try:
        line, column = find(key)
    except (KeyError, TypeError):
        line, column = node.lc.line or 0, node.lc.col or 0
    return line + 1, column + 1


def _worded(model: type[BaseModel], item: ErrorDetails) -> str:
    location, value = item["loc"], item.get("input")
    path = ".".join(str(part) for part in location) or "file"
    if item["type"] == "extra_forbidden":
        return f"{path}: unknown key; {_valid_keys(model, location)}"
    message = item["msg"].removeprefix("Value error, ")
    shown = "" if isinstance(value, (dict, list, BaseModel)) else f" (got {value!r})"
    return f"{path}: {message}{shown}"


def _valid_keys(model: type[BaseModel], location: Sequence[str | int]) -> str:
    """The keys that may stand where ``location`` ends, the most similar one first."""
    for part in location[:-1]:
        inner = model.model_fields.get(str(part))
        found = _model_in(inner.annotation) if inner is not None else None
        # A key of a mapping (an arm's name, an index): its values share one model.
        model = found or model
    keys = list(model.model_fields)
    near = get_close_matches(str(location[-1]), keys, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"{hint}valid: {', '.join(keys)}"


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model that an annotation like ``dict[str, Arm]`` or ``Arm | None`` speaks of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for arg in get_args(annotation) if (found := _model_in(arg))), None)
