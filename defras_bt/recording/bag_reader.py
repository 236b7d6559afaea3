"""Bags back as arrays: this program's recordings, and a laboratory's ROS 1 or ROS 2 bags."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader

from defras_bt.recording.mcap_file import is_cut_off, recover_mcap
from defras_sim.geometry import Floats

_POSE_COLUMNS = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
_WRENCH_COLUMNS = ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")
_FLOATS = {7: "f4", 8: "f8"}


@dataclass(frozen=True)
class Series:
    """All messages of one topic, in order of time.

    ``time_s`` (n,) when recorded; ``stamp_s`` (n,) when measured (``time_s`` where the message has
    no header). ``values`` (n, columns). A cloud's values are empty and ``points_m`` holds an array
    (points, 3) per message; those of strings are empty, and ``texts`` holds them.
    """

    message_type: str
    frame_id: str
    time_s: Floats
    stamp_s: Floats
    columns: tuple[str, ...]
    values: Floats
    points_m: tuple[Floats, ...] = ()
    texts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bag:
    """Topics that could be read, and (topic, message type) of those that are of no known type.

    ``unread`` are the topics that nobody asked for."""

    series: Mapping[str, Series]
    skipped: tuple[tuple[str, str], ...] = field(default=())
    unread: tuple[str, ...] = ()

    def __getitem__(self, topic: str) -> Series:
        if topic not in self.series:
            raise KeyError(f"no topic {topic}; the bag has {', '.join(sorted(self.series))}")
        return self.series[topic]


def read_bag(path: Path, topics: Collection[str] | None = None) -> Bag:
    """Read an MCAP file, a ROS 2 bag folder or a ROS 1 ``.bag`` file.

    An MCAP file that a killed process left without its end is read up to its last whole chunk.
    With ``topics``, only those are read; a laboratory's bag may hold gigabytes of others.
    """
    if path.is_file() and is_cut_off(path):
        with TemporaryDirectory() as folder:
            whole = Path(folder) / path.name
            recover_mcap(path, whole)
            return _read(whole, topics)
    return _read(path, topics)


def _read(path: Path, topics: Collection[str] | None) -> Bag:
    with AnyReader([path]) as reader:
        series: dict[str, Series] = {}
        skipped, unread = [], []
        for topic, found in sorted(reader.topics.items()):
            if topics is not None and topic not in topics:
                unread.append(topic)
                continue
            read = _READERS.get(found.msgtype or "")
            if read is None:
                skipped.append((topic, found.msgtype or "several types"))
                continue
            messages = [
                (at_ns, reader.deserialize(raw, connection.msgtype))
                for connection, at_ns, raw in reader.messages(connections=found.connections)
            ]
            if messages:
                series[topic] = _series(found.msgtype or "", messages, read)
    return Bag(series, tuple(skipped), tuple(unread))


def _series(
    message_type: str,
    messages: list[tuple[int, Any]],
    read: Callable[[Any], tuple[tuple[str, ...], Any]],
) -> Series:
    time_s = np.array([at_ns for at_ns, _ in messages]) / 1e9
    first = messages[0][1]
    stamped = hasattr(first, "header")
    stamp_s = np.array([_stamp_s(m) for _, m in messages]) if stamped else time_s
    content = [read(message) for _, message in messages]
    columns = content[0][0]
    if any(names != columns for names, _ in content):
        raise ValueError(f"{message_type}: the columns change within one topic, first {columns}")
    is_cloud, is_text = message_type.endswith("PointCloud2"), message_type.endswith("String")
    rows = [row for _, row in content]
    return Series(
        message_type=message_type,
        frame_id=first.header.frame_id if stamped else "",
        time_s=time_s,
        stamp_s=stamp_s,
        columns=columns,
        values=np.zeros((len(rows), 0)) if is_cloud or is_text else np.array(rows, float),
        points_m=tuple(rows) if is_cloud else (),
        texts=tuple(rows) if is_text else (),
    )


def _stamp_s(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec) + float(stamp.nanosec) / 1e9


def _pose(message: Any) -> tuple[tuple[str, ...], Any]:
    p, q = message.pose.position, message.pose.orientation
    return _POSE_COLUMNS, (p.x, p.y, p.z, q.x, q.y, q.z, q.w)


def _joints(message: Any) -> tuple[tuple[str, ...], Any]:
    return tuple(message.name), message.position


def _wrench(message: Any) -> tuple[tuple[str, ...], Any]:
    f, m = message.wrench.force, message.wrench.torque
    return _WRENCH_COLUMNS, (f.x, f.y, f.z, m.x, m.y, m.z)


def _plain(message: Any) -> tuple[tuple[str, ...], Any]:
    return ("data",), (float(message.data),)


def _text(message: Any) -> tuple[tuple[str, ...], Any]:
    return ("data",), str(message.data)


def _cloud(message: Any) -> tuple[tuple[str, ...], Any]:
    """Points (n, 3), whatever other fields a camera adds."""
    order = ">" if message.is_bigendian else "<"
    placed = {f.name: (f.offset, f.datatype) for f in message.fields if f.name in "xyz"}
    unread = {name: kind for name, (_, kind) in placed.items() if kind not in _FLOATS}
    if len(placed) != 3 or unread:
        raise ValueError(f"a cloud needs float fields x, y, z; it has {sorted(placed)} {unread}")
    dtype = np.dtype(
        {
            "names": list("xyz"),
            "formats": [order + _FLOATS[placed[name][1]] for name in "xyz"],
            "offsets": [placed[name][0] for name in "xyz"],
            "itemsize": message.point_step,
        }
    )
    count = message.width * message.height
    rows = np.frombuffer(np.asarray(message.data, np.uint8).tobytes(), dtype, count)
    return ("x_m", "y_m", "z_m"), np.stack([rows[name].astype(float) for name in "xyz"], axis=1)


_READERS: dict[str, Callable[[Any], tuple[tuple[str, ...], Any]]] = {
    "geometry_msgs/msg/PoseStamped": _pose,
    "geometry_msgs/msg/WrenchStamped": _wrench,
    "sensor_msgs/msg/JointState": _joints,
    "sensor_msgs/msg/PointCloud2": _cloud,
    "std_msgs/msg/Bool": _plain,
    "std_msgs/msg/Float64": _plain,
    "std_msgs/msg/String": _text,
}
