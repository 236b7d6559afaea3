"""A run told to ROS, so that ``rosbag record -a`` holds everything that a replay needs."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.recording.decisions import DECISIONS_TOPIC, DecisionLines
from defras_bt.recording.inputs import (
    CLOUD_TOPIC,
    INPUTS_TOPIC,
    SETUP_TOPIC,
    input_text,
    setup_text,
)
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_bt.recording.ros_messages import FRAME
from defras_sim.geometry import Floats
from defras_sim.worlds.protocol import PointCloud

_QUEUE = 1000
"""Messages that wait for a slow recorder. One that is lost would be missing in the replay."""


class RosRecorder:
    """Publishes what the executive was told and decided, and the tissue's cloud as it saw it.

    The arms' own topics are the arms'. The process must be a ROS node already.
    """

    def __init__(self, begin_s: float) -> None:
        """``begin_s``: ROS time at which world time is 0.

        Raises:
            RosMissing: ROS 1 is not installed.
        """
        self._begin_s = begin_s
        self._rospy, std = ros_module("rospy"), ros_module("std_msgs.msg")
        self._sensor, self._header = ros_module("sensor_msgs.msg"), std.Header
        kinds = {
            SETUP_TOPIC: std.String,
            DECISIONS_TOPIC: std.String,
            INPUTS_TOPIC: std.String,
            CLOUD_TOPIC: self._sensor.PointCloud2,
        }
        self._out = {
            # A recorder that connects a moment late still gets what a run starts from.
            topic: self._rospy.Publisher(topic, kind, queue_size=_QUEUE, latch=topic == SETUP_TOPIC)
            for topic, kind in kinds.items()
        }
        self._lines = DecisionLines()
        self._cloud: PointCloud | None = None
        self._clouds = 0

    def start(self, info: RunInfo) -> None:
        self._out[SETUP_TOPIC].publish(setup_text(info))
        self._out[DECISIONS_TOPIC].publish(self._lines.first(info))

    def tick(self, record: TickRecord) -> None:
        cloud = record.observation.cloud
        if cloud is not None and (self._cloud is None or cloud.stamp_s != self._cloud.stamp_s):
            self._cloud = cloud
            self._clouds += 1
            self._out[CLOUD_TOPIC].publish(self._cloud_message(cloud))
        number = None if cloud is None else self._clouds - 1
        self._out[INPUTS_TOPIC].publish(input_text(record, number))
        self._out[DECISIONS_TOPIC].publish(self._lines.tick(record))

    def finish(self, summary: RunSummary) -> None:
        for publisher in self._out.values():
            publisher.unregister()

    def _cloud_message(self, cloud: PointCloud) -> Any:
        points: Floats = np.asarray(cloud.points_m)
        field = self._sensor.PointField
        stamp = self._rospy.Time.from_sec(self._begin_s + cloud.stamp_s)
        return self._sensor.PointCloud2(
            header=self._header(stamp=stamp, frame_id=FRAME),
            height=1,
            width=len(points),
            fields=[
                field(name=name, offset=4 * i, datatype=field.FLOAT32, count=1)
                for i, name in enumerate("xyz")
            ],
            is_bigendian=False,
            point_step=12,
            row_step=12 * len(points),
            data=points.astype("<f4").tobytes(),
            is_dense=True,
        )
