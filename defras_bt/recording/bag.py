"""``recording.mcap``: what was measured and commanded, as standard ROS 2 messages."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from defras_bt.recording import ros_messages as ros
from defras_bt.recording.inputs import INPUTS_TOPIC, SETUP_TOPIC, input_text, setup_text
from defras_bt.recording.mcap_file import McapFile
from defras_bt.recording.message_writer import MessageWriter
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_sim.worlds.protocol import PointCloud

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
        self._writer: MessageWriter | None = None
        self._stamps: dict[str, float] = {}
        self._cloud: PointCloud | None = None
        self._clouds = 0

    def start(self, info: RunInfo) -> None:
        self._file = McapFile(self._path)
        self._writer = MessageWriter(self._file)
        self._write_text(SETUP_TOPIC, 0.0, setup_text(info))

    def tick(self, record: TickRecord) -> None:
        now_s, seen = record.time_s, record.observation
        for name, arm in seen.arms.items():
            if self._is_new(name, arm.stamp_s):
                self._opened().write_arm(name, now_s, arm)
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
        if self._file is not None and record.tick % _FLUSH_EVERY == 0:
            self._file.flush()

    def finish(self, summary: RunSummary) -> None:
        if self._file is not None:
            self._file.close()

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
        self._opened().write(topic, message_type, now_s, stamp_s, message)

    def _opened(self) -> MessageWriter:
        if self._writer is None:
            raise RuntimeError("a tick came before the start of the run: call start first")
        return self._writer


def _differs(cloud: PointCloud, last: PointCloud | None) -> bool:
    return last is None or not (
        cloud.stamp_s == last.stamp_s and np.array_equal(cloud.points_m, last.points_m)
    )
