"""What an executive was told, exactly, as part of the recording: enough to decide once more.

The standard topics round and leave out: a pose becomes a quaternion, a stamp whole nanoseconds.
Two topics of strings hold the rest as JSON, in which every float survives to its last bit:
``/executive/setup`` once, with what a run starts from, and ``/executive/inputs`` for every tick.
Clouds stay where they are: an input gives the number of its message on ``/tissue/points``, whose
points have the single precision that sensing works with.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from defras_bt.recording.operator_state import NOBODY, OperatorState
from defras_bt.recording.record import RunInfo, TickRecord
from defras_bt.sensing.sense import SensedObservation
from defras_sim.geometry import Floats, Pose
from defras_sim.worlds.protocol import ArmObservation, Observation, PointCloud

SETUP_TOPIC = "/executive/setup"
INPUTS_TOPIC = "/executive/inputs"
CLOUD_TOPIC = "/tissue/points"

_OPERATOR: TypeAdapter[OperatorState] = TypeAdapter(OperatorState)


@dataclass(frozen=True)
class TickInput:
    """What one tick was told."""

    tick: int
    observation: SensedObservation
    operator: OperatorState


def setup_text(info: RunInfo) -> str:
    """The content of ``/executive/setup``."""
    return _text(
        {
            "scene": info.scene.model_dump(mode="json"),
            "scene_file": info.scene_file,
            "world": info.world,
            "tree": info.tree,
            "seed": info.seed,
            "force_threshold_n": info.force_threshold_n,
            "versions": dict(info.versions),
            "again": dict(info.again),
        }
    )


def input_text(record: TickRecord, cloud: int | None) -> str:
    """One tick. ``cloud``: number of its message on ``/tissue/points``, from 0."""
    content: dict[str, Any] = {
        "tick": record.tick,
        "time_s": record.time_s,
        **_observed(record.observation, cloud),
    }
    if record.operator != NOBODY:
        content["operator"] = _OPERATOR.dump_python(record.operator, mode="json")
    return _text(content)


def read_input(text: str, clouds: Sequence[Floats]) -> TickInput:
    """The tick of ``text``; ``clouds`` holds the points (n, 3) of all messages."""
    content = json.loads(text)
    seen = content.get("cloud")
    observation = SensedObservation(
        time_s=content["time_s"],
        arms={name: _read_arm(arm) for name, arm in content["arms"].items()},
        cloud=None if seen is None else PointCloud(seen["stamp_s"], clouds[seen["number"]]),
        roi_visibility=content.get("roi_visibility"),
        roi_visibility_stamp_s=content.get("roi_visibility_stamp_s"),
        stopped=content.get("stopped", {}),
        faults=tuple(content.get("faults", ())),
        dropped_points=content.get("dropped_points", 0),
    )
    return TickInput(
        content["tick"], observation, _OPERATOR.validate_python(content.get("operator", NOBODY))
    )


def _observed(seen: Observation, cloud: int | None) -> Mapping[str, Any]:
    said: dict[str, Any] = {"arms": {name: _arm(arm) for name, arm in seen.arms.items()}}
    if seen.cloud is not None:
        said["cloud"] = {"number": cloud, "stamp_s": seen.cloud.stamp_s}
    if seen.roi_visibility is not None:
        said["roi_visibility"] = seen.roi_visibility
        said["roi_visibility_stamp_s"] = seen.roi_visibility_stamp_s
    if seen.stopped:
        said["stopped"] = dict(seen.stopped)
    if isinstance(seen, SensedObservation) and (seen.faults or seen.dropped_points):
        said |= {"faults": seen.faults, "dropped_points": seen.dropped_points}
    return said


def _arm(arm: ArmObservation) -> Mapping[str, Any]:
    said: dict[str, Any] = {
        "stamp_s": arm.stamp_s,
        "tip": _pose(arm.tissue_from_tip),
        "setpoint": _pose(arm.setpoint_tissue_from_tip),
        "jaw_rad": arm.jaw_rad,
        "grasped": arm.grasped,
    }
    for name, numbers in (
        ("joints", arm.joints),
        ("setpoint_joints", arm.setpoint_joints),
        ("force_n", arm.force_n),
    ):
        if numbers is not None:
            said[name] = numbers.tolist()
    if arm.goal_tissue_from_tip is not None:
        said["goal"] = _pose(arm.goal_tissue_from_tip)
    return said


def _read_arm(said: Mapping[str, Any]) -> ArmObservation:
    return ArmObservation(
        stamp_s=said["stamp_s"],
        tissue_from_tip=_read_pose(said["tip"]),
        setpoint_tissue_from_tip=_read_pose(said["setpoint"]),
        jaw_rad=said["jaw_rad"],
        grasped=said["grasped"],
        joints=np.array(said["joints"]) if "joints" in said else None,
        setpoint_joints=np.array(said["setpoint_joints"]) if "setpoint_joints" in said else None,
        force_n=np.array(said["force_n"]) if "force_n" in said else None,
        goal_tissue_from_tip=_read_pose(said["goal"]) if "goal" in said else None,
    )


def _pose(pose: Pose) -> list[list[float]]:
    return [pose.position_m.tolist(), pose.rotation.ravel().tolist()]


def _read_pose(said: Sequence[Sequence[float]]) -> Pose:
    position, rotation = said
    return Pose(np.array(position, float), np.array(rotation, float).reshape(3, 3))


def _text(content: Mapping[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":"), default=_plain)


def _plain(value: Any) -> Any:
    """numpy's own numbers, which JSON does not know."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a recording cannot hold {type(value).__name__}: {value!r}")
