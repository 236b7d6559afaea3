"""Readings alone as a bag: for data that was measured without an executive."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from defras_bt.recording import ros_messages as ros
from defras_bt.recording.mcap_file import McapFile
from defras_bt.recording.message_writer import MessageWriter
from defras_sim.worlds.protocol import ArmObservation, PointCloud

_FLUSH_EVERY = 50


class ReadingsBag:
    """Writes the topics of arms and cloud that :mod:`defras_bt.recording.bag` writes, no others.

    Use it with ``with``.
    """

    def __init__(self, path: Path) -> None:
        self._file = McapFile(path)
        self._writer = MessageWriter(self._file)
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
            self._writer.write_arm(name, now_s, seen)
        if cloud is not None:
            message = ros.cloud_message(cloud.stamp_s, cloud.points_m)
            self._writer.write("/tissue/points", ros.CLOUD, now_s, cloud.stamp_s, message)
        self._added += 1
        if self._added % _FLUSH_EVERY == 0:
            self._file.flush()
