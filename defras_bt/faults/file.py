"""Fault files: YAML that says what goes wrong in a run, when, and how likely.

::

    # yaml-language-server: $schema=faults.schema.json
    seed: 7
    faults:
      - {fault: frozen, reading: cloud, start_s: 4.0, duration_s: 2.0}
      - {fault: dropped, reading: camera, probability: 0.4}
      - {fault: node_raises, node: "**/act/*_pull_*", start_s: 5.0}
"""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from defras_bt.executive.registry import did_you_mean
from defras_bt.faults.arms import ArmFault
from defras_bt.faults.fault import Fault
from defras_bt.faults.faults import KINDS, Faults
from defras_bt.faults.readings import ReadingFault
from defras_sim.yaml_source import Fault as FileFault
from defras_sim.yaml_source import InvalidFile, YamlSource, read_yaml

SCHEMA_FILE = "faults.schema.json"
_SCHEMA = "https://json-schema.org/draft/2020-12/schema"
_SEED = {"type": "integer", "minimum": 0, "default": 0, "description": "chance of these faults"}


def read_faults(file: Path, arms: Collection[str]) -> Faults:
    """Read a fault file for a set-up with ``arms``.

    Raises:
        InvalidFile: with everything that is wrong with it.
    """
    source = read_yaml(file)
    found: list[FileFault] = []
    for key in source.data:
        if key not in ("seed", "faults"):
            hint = did_you_mean(str(key), ("seed", "faults"))
            found.append(source.fault((key,), f"{key}: unknown key{hint}"))
    seed = source.data.get("seed", 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        found.append(source.fault(("seed",), f"seed: should be 0, 1, 2, ..., not {seed!r}"))
    entries = source.data.get("faults")
    faults: list[Fault] = []
    if not isinstance(entries, list) or not entries:
        found.append(
            source.fault(("faults",), "faults: list at least one, as {fault: frozen, start_s: 4}")
        )
        entries = []
    for index, entry in enumerate(entries):
        try:
            faults.append(_entry(source, index, entry, arms))
        except InvalidFile as error:
            found += error.faults
    if found:
        raise InvalidFile(found)
    return Faults(tuple(faults), seed)


def _entry(source: YamlSource, index: int, entry: Any, arms: Collection[str]) -> Fault:
    where = ("faults", index)
    if not isinstance(entry, dict):
        text = f"faults.{index}: should be a mapping, as {{fault: frozen, start_s: 4}}"
        raise InvalidFile([source.fault(where, text)])
    name = entry.get("fault")
    if name not in KINDS:
        said = (
            f"say which; there are: {', '.join(KINDS)}"
            if name is None
            else f"there is no fault {name!r}{did_you_mean(str(name), tuple(KINDS))}"
        )
        message = f"faults.{index}.fault: {said}"
        raise InvalidFile([source.fault((*where, "fault"), message)])
    rest = {key: value for key, value in entry.items() if key != "fault"}
    places = {place[2:]: at for place, at in source.places.items() if place[:2] == where}
    fault = YamlSource(source.file, rest, places).validate(KINDS[name])
    key, arm = _arm_of(fault)
    if arm is not None and arm not in arms:
        message = f"faults.{index}.{key}: the scene has no {arm}; it has {', '.join(arms)}"
        raise InvalidFile([source.fault((*where, key), message)])
    return fault


def _arm_of(fault: Fault) -> tuple[str, str | None]:
    """Under which key a fault names an arm, and which."""
    if isinstance(fault, ArmFault):
        return "arm", fault.arm
    if isinstance(fault, ReadingFault) and fault.reading.startswith("psm"):
        return "reading", fault.reading
    return "fault", None


def faults_schema() -> dict[str, Any]:
    """JSON schema of fault files, for editors."""
    kinds = []
    for name, kind in KINDS.items():
        schema = kind.model_json_schema()
        properties = {"fault": {"const": name}, **schema["properties"]}
        kinds.append({**schema, "title": name, "properties": properties, "required": ["fault"]})
    listed = {"type": "array", "minItems": 1, "items": {"oneOf": kinds}}
    return {
        "$schema": _SCHEMA,
        "title": "faults",
        "type": "object",
        "additionalProperties": False,
        "required": ["faults"],
        "properties": {"seed": _SEED, "faults": listed},
    }


def schema_text() -> str:
    return json.dumps(faults_schema(), indent=2) + "\n"
