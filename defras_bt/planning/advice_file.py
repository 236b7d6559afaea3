"""Adding an expert's rule to a scene file, whose comments and layout stay as they are."""

from __future__ import annotations

import re
from io import StringIO
from pathlib import Path

from ruamel.yaml import YAML

from defras_sim.advice import Advice
from defras_sim.scene import Scene, load_scene
from defras_sim.yaml_source import InvalidFile, read_yaml


def rule_name(kind: str, text: str) -> str:
    """A name for a rule that was given none, like ``forbid-grasp-psm1-point-2-3``."""
    return re.sub(r"[^a-z0-9]+", "-", f"{kind} {text}".lower()).strip("-")


def add_advice(file: Path, advice: Advice) -> Scene:
    """Add ``advice`` to the scene in ``file`` and give the scene as it is now.

    The file is left as it was if the scene would not be valid with the rule.

    Raises:
        InvalidFile: the scene is not valid with it, or was not before. What the rule is to blame
            for is told at the place of ``advice`` in ``file``, or at its first line.
        OSError: the file cannot be written.
    """
    before = file.read_text(encoding="utf-8")
    rules = [*load_scene(file).advice, advice]
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.width = 100
    document = yaml.load(before)
    document["advice"] = [rule.model_dump(exclude_none=True) for rule in rules]
    text = StringIO()
    yaml.dump(document, text)
    trial = file.with_name(f".{file.name}.new")
    trial.write_text(text.getvalue(), encoding="utf-8")
    try:
        scene = _with_rule(trial, file, advice)
        trial.replace(file)
    finally:
        trial.unlink(missing_ok=True)
    return scene


def _with_rule(trial: Path, file: Path, advice: Advice) -> Scene:
    """The scene in ``trial``; its faults are told of ``file``, in which the rule is not yet."""
    try:
        return load_scene(trial)
    except InvalidFile as error:
        faults = [fault.message for fault in error.faults]
        source = read_yaml(file)
        raise InvalidFile(
            source.fault(("advice",), f"cannot take the rule '{advice.name}': {message}")
            for message in faults
        ) from error
