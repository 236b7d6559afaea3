"""A bag, through a topic map and past its faults, to a :class:`RecordedRun`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReaderError
from scipy.spatial.transform import Rotation, Slerp

from defras_bt.diagnosis.cloud_reader import read_clouds
from defras_bt.diagnosis.quality import Mask
from defras_bt.diagnosis.recording import Readings, RecordedRun
from defras_bt.diagnosis.topic_map import ArmTopics, JawAngles, TopicMap, own_topics
from defras_bt.diagnosis.topic_reader import PoseReadings, TopicReader, UnusableRecording
from defras_bt.recording.bag_reader import read_bag
from defras_sim.geometry import Floats
from defras_sim.recorded_motion import ArmMotion, RecordedMotion
from defras_sim.scene import ArmName, Scene

__all__ = ["UnusableRecording", "read_recording"]


def read_recording(path: Path, scene: Scene, topics: TopicMap | None = None) -> RecordedRun:
    """Read an MCAP file, a ROS 2 bag folder or a ROS 1 bag.

    ``topics`` says where what stands; without it the topics are those of ``defras run``.

    Raises:
        UnusableRecording: it cannot be read, or something is missing without which nothing can be
            compared; the message says what would be valid.
    """
    chosen = topics or own_topics(tuple(scene.arms))
    unknown = set(chosen.arms) - set(scene.arms)
    if unknown:
        raise UnusableRecording(
            f"the topic map names {', '.join(sorted(unknown))}; the scene {scene.name} has the "
            f"arms {', '.join(scene.arms)}"
        )
    try:
        bag = read_bag(path, chosen.topics)
    except (AnyReaderError, OSError, ValueError) as error:
        raise UnusableRecording(
            f"{path} cannot be read as a recording: {error}; valid are MCAP files, ROS 2 bag "
            "folders and ROS 1 bags"
        ) from error
    reader = TopicReader(path.name, bag, chosen)
    arms = {name: arm for name, arm in chosen.arms.items() if reader.has(arm.setpoint)}
    if not arms:
        name, arm = next(iter(chosen.arms.items()))
        raise reader.missing(f"the set-points of {name}", arm.setpoint)
    if not reader.has(chosen.cloud):
        raise reader.missing("the cloud of the tissue", chosen.cloud)

    def by_arm(read: Callable[[ArmTopics], Readings | None]) -> dict[str, Readings]:
        found = {name: read(arm) for name, arm in arms.items()}
        return {n: r for n, r in found.items() if r is not None and len(r.time_s)}

    motion = _motion(reader, arms, chosen.jaw)
    return RecordedRun(
        name=path.stem if path.stem != "recording" else path.resolve().parent.name,
        motion=motion,
        clouds=read_clouds(reader, chosen.cloud, scene),
        measured_m=by_arm(lambda arm: reader.positions(arm.measured)),
        forces_n=by_arm(lambda arm: reader.forces(arm.force)),
        joints=by_arm(lambda arm: reader.joints(arm.joints)),
        setpoint_joints=by_arm(lambda arm: reader.joints(arm.setpoint_joints)),
        visibility=reader.numbers(chosen.visibility),
        quality=reader.quality,
    )


def _motion(
    reader: TopicReader, arms: Mapping[ArmName, ArmTopics], jaw: JawAngles
) -> RecordedMotion:
    """Set-points and grips of all arms, at every instant at which one of them has a set-point."""
    set_points = {name: reader.poses(arm.setpoint) for name, arm in arms.items()}
    first = max(float(each.time_s[0]) for each in set_points.values())
    last = min(float(each.time_s[-1]) for each in set_points.values())
    instants = np.unique(np.concatenate([each.time_s for each in set_points.values()]).round(6))
    instants = instants[(instants >= first - 1e-6) & (instants <= last + 1e-6)]
    if len(instants) < 2:
        raise UnusableRecording("the set-points of the arms have no time in common")
    motions: dict[str, ArmMotion] = {
        name: ArmMotion(*_at(set_points[name], instants), _grips(reader, arm, jaw, instants))
        for name, arm in arms.items()
    }
    return RecordedMotion(instants, motions)


def _at(poses: PoseReadings, time_s: Floats) -> tuple[Floats, Floats]:
    """Positions (n, 3) and rotations (n, 3, 3) between readings."""
    inside = np.clip(time_s, poses.time_s[0], poses.time_s[-1])
    position = np.stack(
        [np.interp(inside, poses.time_s, poses.position_m[:, k]) for k in range(3)], axis=1
    )
    if len(poses.time_s) == 1:
        return position, np.repeat(poses.rotation, len(inside), axis=0)
    turning = Slerp(poses.time_s, Rotation.from_matrix(poses.rotation))
    return position, turning(inside).as_matrix()


def _grips(reader: TopicReader, arm: ArmTopics, jaw: JawAngles, time_s: Floats) -> Mask:
    """Whether the arm held tissue at each time (n,): as it says itself, else as its jaw shows."""
    said = reader.numbers(arm.grasped)
    if said is not None and len(said.time_s):
        held = said.values[:, 0] > 0.5
        known_s = said.time_s
    else:
        angle = reader.joints(arm.jaw)
        if angle is None or not len(angle.time_s):
            return np.zeros(len(time_s), bool)
        held, known_s = _held_by_jaw(angle.values[:, 0], jaw), angle.time_s
    latest = np.searchsorted(known_s, time_s + 1e-6, side="right") - 1
    return np.asarray(np.where(latest >= 0, held[np.maximum(latest, 0)], False))


def _held_by_jaw(angle_rad: Floats, jaw: JawAngles) -> Mask:
    """A jaw that was wide open and closes takes tissue; it holds until it is wide open again."""
    held = np.zeros(len(angle_rad), bool)
    was_open = holding = False
    for row, angle in enumerate(angle_rad):
        if angle > jaw.open_above_rad:
            was_open, holding = True, False
        elif angle < jaw.closed_below_rad and was_open:
            holding = True
        held[row] = holding
    return held
