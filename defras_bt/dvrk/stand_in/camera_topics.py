"""The topics of the depth camera and the endoscope, as their drivers have them."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.patient import Pictures
from defras_bt.dvrk.stand_in.ros_messages import RosMessages
from defras_sim.geometry import Floats
from defras_sim.worlds.protocol import CameraImage

DEPTH_FRAME, ENDOSCOPE_FRAME = "depth_camera", "endoscope"
"""Optical frames: x right, y down, z ahead."""

CLOUD = "/depth_camera/points"
DEPTH = "/depth_camera/depth/image"
DEPTH_COLOUR = "/depth_camera/colour/image"
DEPTH_INFO = "/depth_camera/camera_info"
ENDOSCOPE = "/endoscope/image"
ENDOSCOPE_INFO = "/endoscope/camera_info"

_QUEUE = 2


class CameraTopics:
    """Publishes pictures: an organised coloured cloud, depth and colour images with their info."""

    def __init__(self, rospy: Any) -> None:
        sensor = ros_module("sensor_msgs.msg")
        self._messages = RosMessages()
        self._out = {
            topic: rospy.Publisher(topic, kind, queue_size=_QUEUE, tcp_nodelay=True)
            for topic, kind in (
                (CLOUD, sensor.PointCloud2),
                (DEPTH, sensor.Image),
                (DEPTH_COLOUR, sensor.Image),
                (DEPTH_INFO, sensor.CameraInfo),
                (ENDOSCOPE, sensor.Image),
                (ENDOSCOPE_INFO, sensor.CameraInfo),
            )
        }

    def publish(self, pictures: Pictures, start_s: float) -> None:
        """``start_s``: ROS time at which the world's time is 0."""
        if pictures.depth is not None:
            self._publish_depth(pictures.depth, start_s)
        if pictures.endoscope is not None:
            image = pictures.endoscope
            stamp_s = start_s + image.stamp_s
            self._send(ENDOSCOPE, self._messages.picture(stamp_s, ENDOSCOPE_FRAME, image.rgb))
            self._send_info(ENDOSCOPE_INFO, stamp_s, ENDOSCOPE_FRAME, image)

    def _publish_depth(self, image: CameraImage, start_s: float) -> None:
        depth_m = image.depth_m
        if depth_m is None:
            raise ValueError("the depth camera's picture has no depth")
        make, stamp_s = self._messages, start_s + image.stamp_s
        if self._wanted(CLOUD):
            points = camera_points_m(image.intrinsics, depth_m)
            self._send(CLOUD, make.cloud(stamp_s, DEPTH_FRAME, points, image.rgb))
        if self._wanted(DEPTH):
            self._send(DEPTH, make.depth(stamp_s, DEPTH_FRAME, depth_m))
        if self._wanted(DEPTH_COLOUR):
            self._send(DEPTH_COLOUR, make.picture(stamp_s, DEPTH_FRAME, image.rgb))
        self._send_info(DEPTH_INFO, stamp_s, DEPTH_FRAME, image)

    def _wanted(self, topic: str) -> bool:
        """Whether anybody listens: large messages are not made for nobody."""
        return bool(self._out[topic].get_num_connections() > 0)

    def _send_info(self, topic: str, stamp_s: float, frame: str, image: CameraImage) -> None:
        height, width = image.rgb.shape[:2]
        shape = (height, width)
        self._send(topic, self._messages.camera_info(stamp_s, frame, image.intrinsics, shape))

    def _send(self, topic: str, message: Any) -> None:
        self._out[topic].publish(message)


def camera_points_m(intrinsics: Floats, depth_m: Floats) -> Floats:
    """Points (h, w, 3) in the camera's frame for depths (h, w) along its axis."""
    rows, columns = np.indices(depth_m.shape)
    x = (columns - intrinsics[0, 2]) / intrinsics[0, 0]
    y = (rows - intrinsics[1, 2]) / intrinsics[1, 1]
    return np.stack([x * depth_m, y * depth_m, depth_m], axis=-1)
