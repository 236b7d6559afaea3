"""Somebody else who commands an arm over ROS, as a program that was forgotten somewhere does."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.ros_messages import RosMessages
from defras_sim.geometry import Pose


class SecondCommander:
    """Publishes set-points on and on along x, whatever the arm makes of them."""

    def __init__(self, rospy: Any, arm: str, begin: Pose, speed_m_s: float) -> None:
        """``begin``: base_from_reported where it starts. ``arm`` as its topics are named."""
        self._messages, self._frame = RosMessages(), f"{arm}_base"
        self._goal, self._speed_m_s = begin, speed_m_s
        pose = ros_module("geometry_msgs.msg").PoseStamped
        self._out = rospy.Publisher(f"/{arm}/servo_cp", pose, queue_size=1, tcp_nodelay=True)

    def go_on(self, time_s: float, ros_s: float) -> None:
        """``time_s`` has passed since the goal before; ``ros_s``: ROS time."""
        self._goal = self._goal.moved(np.array([self._speed_m_s * time_s, 0.0, 0.0]))
        self._out.publish(self._messages.pose(ros_s, self._frame, self._goal))

    def close(self) -> None:
        """Command nothing more."""
        self._out.unregister()
