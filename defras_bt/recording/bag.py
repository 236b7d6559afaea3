"""``recording.mcap``: what was measured and commanded, as standard ROS 2 messages."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from defras_bt.recording import ros_messages as ros
from defras_bt.recording.inputs import INPUTS_TOPIC, SETUP_TOPIC, input_text, setup_text
from defras_bt.recording.mcap_file import McapFile
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_sim.geometry import Floats, Pose
from defras_sim.worlds.protocol import ArmObservation, PointCloud

# A killed process loses at most the messages of so many ticks; see mcap_file for the rest. Often,
# so that no tick has much to write.
_FLUSH_EVERY = 4


class BagRecorder:
    """Writes ``path`` with the topics of the documentation of recordings.

    A message is logged at the world time of its tick and stamped with the world time at which it
    was measured; a reading is written once, however many ticks it stays the latest.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: McapFile | None = None
        self._channels: dict[str, int] = {}
        self._stamps: dict[str, float] = {}
        self._cloud: PointCloud | None = None
        self._clouds = 0
        self._turned: dict[str, tuple[Floats, Floats]] = {}
        """Last rotation (3, 3) and quaternion (4,) by topic: arms turn in few ticks."""

    def start(self, info: RunInfo) -> None:
        self._file = McapFile(self._path)
        self._write_text(SETUP_TOPIC, 0.0, setup_text(info))

    def tick(self, record: TickRecord) -> None:
        now_s, seen = record.time_s, record.observation
        for name, arm in seen.arms.items():
            self._write_arm(f"/{name.upper()}", now_s, arm)
        if seen.cloud is not None and _differs(seen.cloud, self._cloud):
            self._cloud = seen.cloud
            self._clouds += 1
            stamp_s = seen.cloud.stamp_s
            message = ros.cloud_message(stamp_s, seen.cloud.points_m)
            self._write("/tissue/points", ros.CLOUD, now_s, stamp_s, message)
        visible, topic = seen.roi_visibility, "/endoscope/roi_visibility"
        if visible is not None and math.isfinite(visible):
            seen_s = seen.roi_visibility_stamp_s
            stamp_s = now_s if seen_s is None else seen_s
            if self._is_new(topic, stamp_s):
                self._write(topic, ros.NUMBER, now_s, stamp_s, ros.number_message(visible))
        cloud = None if seen.cloud is None else self._clouds - 1
        self._write_text(INPUTS_TOPIC, now_s, input_text(record, cloud))
        if record.tick % _FLUSH_EVERY == 0:
            self._opened().flush()

    def finish(self, summary: RunSummary) -> None:
        if self._file is not None:
            self._file.close()

    def _write_arm(self, arm: str, now_s: float, seen: ArmObservation) -> None:
        stamp_s = seen.stamp_s
        if not self._is_new(arm, stamp_s):
            return
        for topic, pose in (
            ("measured_cp", seen.tissue_from_tip),
            ("setpoint_cp", seen.setpoint_tissue_from_tip),
        ):
            turned = self._quaternion_xyzw(f"{arm}/{topic}", pose)
            message = ros.pose_message(stamp_s, pose, turned)
            self._write(f"{arm}/{topic}", ros.POSE, now_s, stamp_s, message)
        for topic, joints in (
            ("measured_js", seen.joints),
            ("setpoint_js", seen.setpoint_joints),
        ):
            if joints is not None:
                message = ros.joint_message(stamp_s, ros.JOINTS, joints)
                self._write(f"{arm}/{topic}", ros.JOINT, now_s, stamp_s, message)
        jaw = ros.joint_message(stamp_s, ("jaw",), np.array([seen.jaw_rad]))
        self._write(f"{arm}/jaw/measured_js", ros.JOINT, now_s, stamp_s, jaw)
        if seen.force_n is not None:
            message = ros.force_message(stamp_s, seen.force_n)
            self._write(f"{arm}/body/measured_cf", ros.WRENCH, now_s, stamp_s, message)
        if seen.grasped is not None:
            message = ros.flag_message(seen.grasped)
            self._write(f"{arm}/grasped", ros.FLAG, now_s, stamp_s, message)

    def _quaternion_xyzw(self, topic: str, pose: Pose) -> Floats:
        last = self._turned.get(topic)
        if last is None or not np.array_equal(last[0], pose.rotation):
            last = self._turned[topic] = (pose.rotation.copy(), pose.quaternion_xyzw)
        return last[1]

    def _write_text(self, topic: str, now_s: float, text: str) -> None:
        self._write(topic, ros.TEXT, now_s, now_s, ros.text_message(text))

    def _is_new(self, reading: str, stamp_s: float) -> bool:
        if self._stamps.get(reading) == stamp_s:
            return False
        self._stamps[reading] = stamp_s
        return True

    def _write(
        self, topic: str, message_type: str, now_s: float, stamp_s: float, message: bytes
    ) -> None:
        file = self._opened()
        if topic not in self._channels:
            definition = ros.definition(message_type)
            self._channels[topic] = file.add_channel(topic, message_type, definition)
        times = (ros.nanoseconds(now_s), ros.nanoseconds(stamp_s))
        file.write(self._channels[topic], *times, message)

    def _opened(self) -> McapFile:
        if self._file is None:
            raise RuntimeError("a tick came before the start of the run: call start first")
        return self._file


def _differs(cloud: PointCloud, last: PointCloud | None) -> bool:
    return last is None or not (
        cloud.stamp_s == last.stamp_s and np.array_equal(cloud.points_m, last.points_m)
    )
