"""Writing scenes as YAML that people like to read, and the JSON schema their editors use."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.scalarstring import DoubleQuotedScalarString

from defras_sim.scene import Scene

SCHEMA_LINE = "# yaml-language-server: $schema=scene.schema.json\n"


def write_scene(scene: Scene, file: Path) -> None:
    """Write everything in which ``scene`` differs from the defaults.

    The file of its anatomy, if it has one, is put beside it.
    """
    anatomy = scene.tissue.anatomy
    if anatomy is not None and anatomy.file.parent.resolve() != file.parent.resolve():
        shutil.copyfile(anatomy.file, file.parent / anatomy.file.name)
    _write(scene.model_dump(mode="json", exclude_defaults=True), file)


def write_variant(scene: Scene, base: str, file: Path) -> None:
    """Write ``scene`` as another set of attachments over the scene file ``base`` beside it."""
    variant = {
        "extends": base,
        "name": scene.name,
        "description": scene.description,
        "attachments": {"map": list(scene.attachments.map)},
    }
    _write(variant, file)


def scene_schema() -> dict[str, Any]:
    """JSON schema of scene files. With ``extends``, every other key may come from the base file."""
    schema = Scene.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["properties"]["extends"] = {
        "type": "string",
        "description": "another scene file in the same folder that this one is laid over",
    }
    required = schema.pop("required")
    schema["anyOf"] = [{"required": ["extends"]}, {"required": required}]
    attachments = schema["$defs"]["Attachments"]
    attachments["properties"]["map"]["items"]["pattern"] = "^[#. ]+$"
    return schema


def schema_text() -> str:
    return json.dumps(scene_schema(), indent=2) + "\n"


def _write(values: Mapping[str, Any], file: Path) -> None:
    yaml = YAML()
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.width = 100
    text = StringIO()
    yaml.dump(_styled(values), text)
    file.write_text(SCHEMA_LINE + text.getvalue(), encoding="utf-8")


def _styled(node: Any) -> Any:
    """Vectors in one line, the map as a quoted block of rows."""
    if isinstance(node, Mapping):
        return CommentedMap({key: _styled(value) for key, value in node.items()})
    if isinstance(node, list):
        if node and set("".join(map(str, node))) <= {"#", ".", " "}:
            return CommentedSeq(DoubleQuotedScalarString(row) for row in node)
        styled = CommentedSeq(_styled(item) for item in node)
        if not any(isinstance(item, (Mapping, list)) for item in node):
            styled.fa.set_flow_style()
        return styled
    return node
