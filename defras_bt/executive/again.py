"""What a run starts from besides its scene, as plain values and back, so that it can run again.

Tree files travel with the recording: a replay a year later must not depend on what has become of
them since.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from defras_bt.executive.substitution import Substitute, Substitutes
from defras_bt.executive.tree_file import read_tree
from defras_bt.faults.faults import KINDS, Faults
from defras_bt.faults.system import PlannerTimesOut, TwinDiverges
from defras_bt.learning.networks.own_weights import OwnWeights
from defras_bt.planning.plan import Plan

if TYPE_CHECKING:
    from defras_bt.executive.operation import Operation

_PLAN: TypeAdapter[Plan | None] = TypeAdapter(Plan | None)


_UNSEEN_FAULTS = (TwinDiverges, PlannerTimesOut)
"""Injected faults whose effect does not stand in what was sensed: they have to happen again."""


def again_values(operation: Operation, faults: Faults) -> Mapping[str, Any]:
    """For :attr:`~defras_bt.recording.record.RunInfo.again`."""
    return {
        "tree": tree_files(operation.tree_file),
        "max_time_s": operation.max_time_s,
        "weights": None if operation.weights is None else operation.weights.values(),
        "preoperative": _PLAN.dump_python(operation.preoperative, mode="json"),
        "substitutes": [
            entry.model_dump(mode="json", exclude_unset=True)
            for entry, _ in operation.substitutes.entries
        ],
        "faults": [
            {"fault": fault.kind, **fault.model_dump(mode="json")}
            for fault in faults.faults
            if isinstance(fault, _UNSEEN_FAULTS)
        ],
    }


def recorded_plan(again: Mapping[str, Any]) -> Plan | None:
    """The plan that was made before the operation."""
    return _PLAN.validate_python(again["preoperative"])


def recorded_weights(again: Mapping[str, Any]) -> OwnWeights | None:
    """The weights that were used in place of the shipped ones; None if those were.

    Raises:
        NoWeights: they are not where they were, or others are.
    """
    # Recordings from before there was a choice do not say.
    values = again.get("weights")
    return None if values is None else OwnWeights.recorded(values)


def recorded_substitutes(again: Mapping[str, Any], file: Path) -> Substitutes:
    """Which nodes were substituted; ``file``: where that stands."""
    entries = (Substitute.model_validate(entry) for entry in again["substitutes"])
    return Substitutes(tuple((entry, (file, 1, 1)) for entry in entries))


def recorded_faults(again: Mapping[str, Any]) -> Faults:
    """Which faults of the program itself were injected."""
    return Faults(
        tuple(
            KINDS[entry["fault"]].model_validate({k: v for k, v in entry.items() if k != "fault"})
            for entry in again["faults"]
        )
    )


def tree_files(main: Path) -> Mapping[str, Any]:
    """The text of a tree file and of everything it includes, by path from their common folder."""
    files = {main.resolve(), *(node.place[0].resolve() for _, node in read_tree(main).root.walk())}
    folder = Path(os.path.commonpath([file.parent for file in files]))
    return {
        "main": str(main.resolve().relative_to(folder)),
        "files": {
            str(file.relative_to(folder)): file.read_text(encoding="utf-8")
            for file in sorted(files)
        },
    }


def unpack_tree(again: Mapping[str, Any], folder: Path) -> Path:
    """Write the recorded tree files into ``folder``; returns the one that was run."""
    tree = again["tree"]
    for name, text in tree["files"].items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder / str(tree["main"])
