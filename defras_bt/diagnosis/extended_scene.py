"""``extended_scene.yaml``: the scene that was believed, with the named effects adopted."""

from __future__ import annotations

import os
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from defras_bt.diagnosis.report_words import cause_words, either, key_words
from defras_bt.diagnosis.verdict import Cause, Verdict
from defras_bt.recording.whole_file import write_whole
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_file import SCHEMA_LINE, write_scene

FULL_NAME = "believed_scene.yaml"
"""The believed scene, where the extended one cannot stand on the file that it was read from."""


def extended_name(scene: Scene) -> str:
    """What ``scene`` is called once a diagnosis has extended it."""
    return f"{scene.name}_extended"


def adopted_effects(scene: Scene, verdict: Verdict) -> list[dict[str, Any]]:
    """``model.effects`` of the extended scene: those of ``scene``, with what was found.

    A cause that cannot be told from others is not adopted: a model with a wrong name in it is worse
    than one that is known to lack something. Parameters of an effect that ``scene`` has already are
    replaced; an effect's several sites (two joints with play) are laid together.

    Raises:
        ValueError: two causes set one parameter of an effect to different values.
    """
    adopted: dict[str, dict[str, float]] = {
        each.effect: dict(each.values) for each in scene.model.effects
    }
    found: dict[tuple[str, str], float] = {}
    for cause in _told_apart(verdict):
        values = adopted.setdefault(cause.effect, {})
        for name, estimate in cause.parameters.items():
            known = found.setdefault((cause.effect, name), estimate.value)
            if known != estimate.value:
                raise ValueError(
                    f"{cause.effect} cannot be adopted with {name} of both {known:g} and "
                    f"{estimate.value:g}: an effect is in a model once"
                )
            values[name] = float(f"{estimate.value:.6g}")
    return [{"effect": effect, **values} for effect, values in adopted.items()]


def write_extended_scene(scene_file: Path, verdict: Verdict, path: Path) -> Scene:
    """Write ``path``, which extends ``scene_file`` by the named effects; return it as loaded.

    A scene with a patient's anatomy refers to a file beside it; then the believed scene is copied
    beside ``path`` with it, and extended there.

    Raises:
        InvalidFile: ``scene_file`` is no scene, or the scene with the effects is not valid.
        OSError: it cannot be written.
    """
    scene = load_scene(scene_file)
    base = os.path.relpath(scene_file.resolve(), path.resolve().parent)
    if scene.tissue.anatomy is not None and scene_file.resolve().parent != path.resolve().parent:
        write_scene(scene, path.with_name(FULL_NAME))
        base = FULL_NAME
    write_whole(path, _text(scene, base, verdict))
    return load_scene(path)


def _text(scene: Scene, base: str, verdict: Verdict) -> str:
    effects = CommentedSeq(CommentedMap(each) for each in adopted_effects(scene, verdict))
    document = CommentedMap(
        {
            "extends": base,
            "name": extended_name(scene),
            "description": f"{scene.name} with what a diagnosis named.",
            "model": CommentedMap({"effects": effects}),
        }
    )
    for each in effects:
        each.fa.set_flow_style()
    yaml = YAML()
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.width = 4096
    text = StringIO()
    yaml.dump(document, text)
    return SCHEMA_LINE + "".join(f"# {line}\n" for line in _remarks(verdict)) + text.getvalue()


def _remarks(verdict: Verdict) -> list[str]:
    adopted = _told_apart(verdict)
    lines = [cause_words(cause) for cause in adopted]
    left_out = [cause for cause in verdict.causes if cause not in adopted]
    for cause in left_out:
        lines.append(
            "Not adopted, because it cannot be told from "
            f"{either([key_words(key) for key in cause.cannot_tell])}: {cause_words(cause)}"
        )
    if verdict.verdict == "set" and not left_out:
        names = either([key_words(key) for key in verdict.ambiguous])
        lines.append(f"Nothing is adopted of what cannot be told apart: {names}")
    return lines or ["Nothing was found that the scene lacks."]


def _told_apart(verdict: Verdict) -> tuple[Cause, ...]:
    return tuple(cause for cause in verdict.causes if not cause.cannot_tell)
