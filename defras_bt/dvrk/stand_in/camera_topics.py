"""The topics of the depth camera and the endoscope, as their drivers have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.delivery import Delivery
from defras_bt.dvrk.stand_in.faults import CameraFault
from defras_bt.dvrk.stand_in.menu import Menu
from defras_bt.dvrk.stand_in.patient import Pictures
from defras_bt.dvrk.stand_in.ros_messages import RosMessages
from defras_bt.dvrk.stand_in.witness import Witness
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

    def __init__(self, rospy: Any, delivery: Delivery, menu: Menu, witness: Witness) -> None:
        sensor = ros_module("sensor_msgs.msg")
        self._messages, self._delivery, self._menu = RosMessages(), delivery, menu
        self._frozen: CameraImage | None = None
        self._witness = witness
        self._rospy = rospy
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

    def publish(self, pictures: Pictures, start_s: float, now_s: float) -> None:
        """What is new at world time ``now_s``; ``start_s`` is ROS time of its 0."""
        if pictures.depth is not None:
            self._publish_depth(self._of_the_driver(pictures.depth), start_s, now_s)
        if pictures.endoscope is not None:
            image, make = pictures.endoscope, self._messages
            stamp_s = start_s + image.stamp_s
            matrix, shape = image.intrinsics, _shape(image)
            for topic, message in (
                (ENDOSCOPE, make.picture(stamp_s, ENDOSCOPE_FRAME, image.rgb)),
                (ENDOSCOPE_INFO, make.camera_info(stamp_s, ENDOSCOPE_FRAME, matrix, shape)),
            ):
                self._delivery.deliver("endoscope", self._out[topic], message, now_s)

    def _of_the_driver(self, image: CameraImage) -> CameraImage:
        """A driver whose camera hangs gives its last picture a new stamp."""
        frozen = any(fault.fault == "frozen" for fault in self._menu.there(CameraFault))
        if not frozen or self._frozen is None:
            self._frozen = image
            return image
        return replace(self._frozen, stamp_s=image.stamp_s)

    def _publish_depth(self, image: CameraImage, start_s: float, now_s: float) -> None:
        depth_m = image.depth_m
        if depth_m is None:
            raise ValueError("the depth camera's picture has no depth")
        kinds = {fault.fault for fault in self._menu.there(CameraFault)}
        frame = "map" if "wrong_frame" in kinds else DEPTH_FRAME
        depth = 1e3 * depth_m if "millimetres" in kinds else depth_m
        make, stamp_s = self._messages, start_s + image.stamp_s
        matrix, shape = image.intrinsics, _shape(image)
        parts: tuple[tuple[str, Callable[[], Any]], ...] = (
            (CLOUD, lambda: make.cloud(stamp_s, frame, camera_points_m(matrix, depth), image.rgb)),
            (DEPTH, lambda: make.depth(stamp_s, frame, depth)),
            (DEPTH_COLOUR, lambda: make.picture(stamp_s, frame, image.rgb)),
            (DEPTH_INFO, lambda: make.camera_info(stamp_s, frame, matrix, shape)),
        )
        for topic, made in parts:
            # Large messages are not made for nobody.
            if self._out[topic].get_num_connections() > 0:
                self._delivery.deliver("cloud", self._out[topic], made(), now_s)
        # World time, but by the clock that arms and clients see: rendering took its while.
        left_s = self._rospy.get_time() - start_s
        self._witness.tell("picture", left_s, stamp_s=image.stamp_s, faults=sorted(kinds))


def _shape(image: CameraImage) -> tuple[int, int]:
    return image.rgb.shape[0], image.rgb.shape[1]


def camera_points_m(intrinsics: Floats, depth_m: Floats) -> Floats:
    """Points (h, w, 3) in the camera's frame for depths (h, w) along its axis, in their unit."""
    rows, columns = np.indices(depth_m.shape)
    x = (columns - intrinsics[0, 2]) / intrinsics[0, 0]
    y = (rows - intrinsics[1, 2]) / intrinsics[1, 1]
    return np.stack([x * depth_m, y * depth_m, depth_m], axis=-1)
