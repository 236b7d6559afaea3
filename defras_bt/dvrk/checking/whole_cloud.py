"""The depth camera's newest cloud with everything in it, not the tissue alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_bt.dvrk.cameras.point_cloud import decode_cloud
from defras_bt.dvrk.cameras.unusable import Unusable
from defras_bt.dvrk.ros_packages import ros_module
from defras_sim.geometry import Floats, Pose

_LARGEST_MESSAGE = 2**25


class WholeCloud:
    """Keeps the newest message of a cloud topic and decodes it when asked."""

    def __init__(self, topic: str, tissue_from_camera: Pose) -> None:
        """The process must be a ROS node already."""
        rospy, kind = ros_module("rospy"), ros_module("sensor_msgs.msg").PointCloud2
        self._tissue_from_camera = tissue_from_camera
        self._message: Any = None
        self._subscriber = rospy.Subscriber(
            topic, kind, self._hear, queue_size=1, buff_size=_LARGEST_MESSAGE, tcp_nodelay=True
        )

    def points_m(self) -> Floats | None:
        """All finite points (n, 3) in the tissue frame; None where no usable cloud came."""
        if self._message is None:
            return None
        try:
            points = decode_cloud(self._message).points.reshape(-1, 3)
        except Unusable:
            return None  # the camera check says what is wrong with it
        return self._tissue_from_camera.apply(points[np.isfinite(points).all(axis=1)])

    def close(self) -> None:
        self._subscriber.unregister()

    def _hear(self, message: Any) -> None:
        self._message = message
