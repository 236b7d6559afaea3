"""Readings alone as a bag: for data that was measured without an executive."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from defras_bt.recording import ros_messages as ros
from defras_bt.recording.mcap_file import McapFile
from defras_sim.worlds.protocol import ArmObservation, PointCloud

_FLUSH_EVERY = 50


class ReadingsBag:
    """Writes the topics of arms and cloud that :mod:`defras_bt.recording.bag` writes, no others.

    Use it with ``with``.
    """

    def __init__(self, path: Path) -> None:
        self._file = McapFile(path)
        self._channels: dict[str, int] = {}
        self._added = 0

    def __enter__(self) -> ReadingsBag:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(
        self, now_s: float, arms: Mapping[str, ArmObservation], cloud: PointCloud | None
    ) -> None:
        """What came in at ``now_s``; no cloud where none is new."""
        for name, seen in arms.items():
            self._add_arm(f"/{name.upper()}", now_s, seen)
        if cloud is not None:
            message = ros.cloud_message(cloud.stamp_s, cloud.points_m)
            self._write("/tissue/points", ros.CLOUD, now_s, cloud.stamp_s, message)
        self._added += 1
        if self._added % _FLUSH_EVERY == 0:
            self._file.flush()

    def _add_arm(self, arm: str, now_s: float, seen: ArmObservation) -> None:
        stamp_s = seen.stamp_s
        for topic, pose in (
            ("measured_cp", seen.tissue_from_tip),
            ("setpoint_cp", seen.setpoint_tissue_from_tip),
        ):
            message = ros.pose_message(stamp_s, pose, pose.quaternion_xyzw)
            self._write(f"{arm}/{topic}", ros.POSE, now_s, stamp_s, message)
        jaw = ros.joint_message(stamp_s, ("jaw",), np.array([seen.jaw_rad]))
        self._write(f"{arm}/jaw/measured_js", ros.JOINT, now_s, stamp_s, jaw)
        if seen.force_n is not None:
            message = ros.force_message(stamp_s, seen.force_n)
            self._write(f"{arm}/body/measured_cf", ros.WRENCH, now_s, stamp_s, message)
        if seen.grasped is not None:
            message = ros.flag_message(seen.grasped)
            self._write(f"{arm}/grasped", ros.FLAG, now_s, stamp_s, message)

    def _write(
        self, topic: str, message_type: str, now_s: float, stamp_s: float, message: bytes
    ) -> None:
        if topic not in self._channels:
            definition = ros.definition(message_type)
            self._channels[topic] = self._file.add_channel(topic, message_type, definition)
        times = (ros.nanoseconds(now_s), ros.nanoseconds(stamp_s))
        self._file.write(self._channels[topic], *times, message)
