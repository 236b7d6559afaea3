"""Somebody else who commands an arm over ROS, as a program that was forgotten somewhere does."""

from __future__ import annotations

from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.ros_messages import RosMessages
from defras_sim.geometry import Pose

_FARTHEST_M = 0.01
"""Held tissue is pulled to and fro by so much, and not torn: nobody could start anew with it."""


class SecondCommander:
    """Publishes set-points to and fro along x, whatever the arm makes of them."""

    def __init__(self, rospy: Any, arm: str, begin: Pose, speed_m_s: float) -> None:
        """``begin``: base_from_reported where it starts. ``arm`` as its topics are named."""
        self._messages, self._frame = RosMessages(), f"{arm}_base"
        self._begin, self._way_m, self._speed_m_s = begin, 0.0, speed_m_s
        pose = ros_module("geometry_msgs.msg").PoseStamped
        self._out = rospy.Publisher(f"/{arm}/servo_cp", pose, queue_size=1, tcp_nodelay=True)

    def go_on(self, time_s: float, ros_s: float) -> None:
        """``time_s`` has passed since the goal before; ``ros_s``: ROS time."""
        self._way_m += self._speed_m_s * time_s
        if abs(self._way_m) >= _FARTHEST_M:
            self._speed_m_s = -abs(self._speed_m_s) * np.sign(self._way_m)
        goal = self._begin.moved(np.array([self._way_m, 0.0, 0.0]))
        self._out.publish(self._messages.pose(ros_s, self._frame, goal))

    def close(self) -> None:
        """Command nothing more."""
        self._out.unregister()
