"""Bags as laboratories write them: other topics, units, frames and clocks than this program's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import Stores, get_typestore

from defras_sim.geometry import Floats, Pose

ROS1 = get_typestore(Stores.ROS1_NOETIC)


@dataclass(frozen=True)
class Track:
    """A tip that rests, takes tissue at ``grasp_s`` and lifts it by 1 cm/s for two seconds."""

    duration_s: float = 6.0
    period_s: float = 0.05
    grasp_s: float = 2.0

    @property
    def time_s(self) -> Floats:
        return np.arange(0.0, self.duration_s, self.period_s)

    def tip_m(self, time_s: Floats) -> Floats:
        """Tips (n, 3) in the tissue frame."""
        lift = np.clip(time_s - self.grasp_s - 0.5, 0.0, 2.0) * 0.01
        return np.stack([0.03 + 0 * lift, 0.02 + 0 * lift, lift], axis=1)

    def jaw_rad(self, time_s: Floats) -> Floats:
        """Open from 1 s on, closed on tissue from the grasp on, open again in the last second."""
        closed = (time_s >= self.grasp_s) & (time_s < self.duration_s - 1.0)
        return np.where(closed, 0.15, np.where(time_s >= 1.0, 0.8, 0.0))


@dataclass
class Bag:
    """Messages by topic: (received [s], type, message)."""

    messages: list[tuple[float, str, str, Any]] = field(default_factory=list)

    def add(self, topic: str, kind: str, received_s: float, message: Any) -> None:
        self.messages.append((received_s, topic, kind, message))

    def write(self, path: Path) -> Path:
        """As a ROS 1 bag."""
        with Ros1Writer(path) as writer:
            connections = {
                (topic, kind): writer.add_connection(topic, kind, typestore=ROS1)
                for topic, kind in {(topic, kind) for _, topic, kind, _ in self.messages}
            }
            for received_s, topic, kind, message in sorted(self.messages, key=lambda m: m[0]):
                raw = ROS1.serialize_ros1(message, kind)
                writer.write(connections[topic, kind], round(1e9 * (received_s + 10.0)), raw)
        return path


def header(stamp_s: float, frame: str) -> Any:
    seconds, rest = divmod(round((stamp_s + 10.0) * 1e9), 10**9)
    stamp = ROS1.types["builtin_interfaces/msg/Time"](sec=int(seconds), nanosec=int(rest))
    return ROS1.types["std_msgs/msg/Header"](seq=0, stamp=stamp, frame_id=frame)


def pose(stamp_s: float, frame: str, position: Floats, turned_xyzw: Floats) -> Any:
    point = ROS1.types["geometry_msgs/msg/Point"](*map(float, position))
    turn = ROS1.types["geometry_msgs/msg/Quaternion"](*map(float, turned_xyzw))
    placed = ROS1.types["geometry_msgs/msg/Pose"](point, turn)
    return ROS1.types["geometry_msgs/msg/PoseStamped"](header(stamp_s, frame), placed)


def joint(stamp_s: float, name: str, position: float) -> Any:
    nothing = np.zeros(0)
    kind = ROS1.types["sensor_msgs/msg/JointState"]
    return kind(header(stamp_s, ""), [name], np.array([position]), nothing, nothing)


def cloud(stamp_s: float, frame: str, points: Floats) -> Any:
    points = np.ascontiguousarray(points, np.float32)
    make = ROS1.types["sensor_msgs/msg/PointField"]
    fields = [make(name, 4 * i, 7, 1) for i, name in enumerate("xyz")]
    return ROS1.types["sensor_msgs/msg/PointCloud2"](
        header(stamp_s, frame), 1, len(points), fields, False, 12, 12 * len(points),
        points.view(np.uint8).ravel(), True,
    )  # fmt: skip


Scale = Mapping[str, float]


def laboratory(
    track: Track,
    *,
    frame: str = "tissue",
    frame_from_tissue: Pose | None = None,
    length: float = 1.0,
    camera_late_s: float = 0.0,
    spoil: Callable[[str, int, Any], Any | None] | None = None,
    seed: int = 3,
) -> Bag:
    """A bag of ``track`` on a laboratory's topics; ``length`` units per metre.

    ``spoil`` gets topic, index and the message's numbers and returns what is written instead, or
    None for a message that never came. ``camera_late_s``: how far the camera's clock is ahead.
    """
    rng = np.random.default_rng(seed)
    placed = frame_from_tissue or Pose(np.zeros(3))
    down = Pose(np.zeros(3), np.diag([1.0, -1.0, -1.0]))
    bag = Bag()

    def add(topic: str, kind: str, index: int, time_s: float, numbers: Any, make: Any) -> None:
        said = numbers if spoil is None else spoil(topic, index, numbers)
        if said is not None:
            bag.add(topic, kind, time_s, make(said))

    turned = (placed @ down).quaternion_xyzw
    for i, t in enumerate(track.time_s):
        tip = placed.apply(track.tip_m(np.array([t])))[0] * length
        for topic, noise in (("/left/goal", 0.0), ("/left/seen", 2e-5 * length)):
            row = np.concatenate([tip + noise * rng.standard_normal(3), turned])
            add(
                topic, "geometry_msgs/msg/PoseStamped", i, float(t), row,
                lambda said, t=t: pose(t, frame, said[:3], said[3:]),
            )  # fmt: skip
        jaw = float(track.jaw_rad(np.array([t]))[0])
        add(
            "/left/jaw", "sensor_msgs/msg/JointState", i, float(t), np.rad2deg(jaw),
            lambda said, t=t: joint(t, "jaw", said),
        )  # fmt: skip
    side = np.linspace(-0.055, 0.055, 24)
    flat = np.stack([*np.meshgrid(side, side), np.zeros((24, 24))], axis=-1).reshape(-1, 3)
    for i, t in enumerate(np.arange(0.0, track.duration_s, 0.1)):
        points = placed.apply(flat + 5e-4 * rng.standard_normal(flat.shape)) * length
        add(
            "/camera/points", "sensor_msgs/msg/PointCloud2", i, float(t), points,
            lambda said, t=t: cloud(t + camera_late_s, frame, said),
        )  # fmt: skip
    return bag
