"""CRTK over ROS 2. Written against rclpy's documentation and never run: no ROS 2 was at hand."""

from __future__ import annotations

import os
from importlib import import_module
from threading import Thread
from types import ModuleType
from typing import Any

from defras_bt.dvrk.ros_packages import RosMissing
from defras_bt.dvrk.settings import Ros2Transport
from defras_bt.dvrk.transport.messages import JOINTS, POSES, STATES, WRENCHES
from defras_bt.dvrk.transport.ros_reading import joints, pose, state, wrench
from defras_bt.dvrk.transport.transport import Receive
from defras_sim.geometry import Pose

INSTALL = (
    "install ROS 2 (docs.ros.org), source its setup.bash, and build crtk_msgs "
    "(github.com/collaborative-robotics/crtk_msgs) in your workspace; then start defras with a "
    "virtual environment of the same Python version"
)
_DEPTH = 1


class Ros2:
    """A node that listens to arms and commands them."""

    def __init__(self, settings: Ros2Transport, node: str = "defras") -> None:
        """
        Raises:
            RosMissing: ROS 2, or crtk_msgs in it, is not installed.
        """
        os.environ["ROS_DOMAIN_ID"] = str(settings.domain_id)
        self._rclpy = _module("rclpy")
        self._geometry, self._sensor = _module("geometry_msgs.msg"), _module("sensor_msgs.msg")
        self._std, self._crtk = _module("std_msgs.msg"), _module("crtk_msgs.msg")
        executors = _module("rclpy.executors")
        self._context = self._rclpy.Context()
        self._rclpy.init(context=self._context)
        self._node = self._rclpy.create_node(node, context=self._context)
        self._executor = executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self.simulated_clock = False
        self._publishers: dict[tuple[str, str], Any] = {}
        self._thread = Thread(target=self._executor.spin, name="ROS 2", daemon=True)
        self._thread.start()

    def listen(self, arm: str, topic: str, receive: Receive) -> None:
        kinds = {
            **dict.fromkeys(POSES, (self._geometry.PoseStamped, pose)),
            **dict.fromkeys(JOINTS, (self._sensor.JointState, joints)),
            **dict.fromkeys(WRENCHES, (self._geometry.WrenchStamped, wrench)),
            **dict.fromkeys(STATES, (self._crtk.OperatingState, state)),
        }
        kind, read = kinds[topic]
        self._node.create_subscription(
            kind, f"/{arm}/{topic}", lambda message: receive(read(message, _stamp_s)), _DEPTH
        )

    def announce(self, arm: str) -> None:
        self._publisher(arm, "servo_cp", self._geometry.PoseStamped)
        self._publisher(arm, "jaw/servo_jp", self._sensor.JointState)
        self._publisher(arm, "hold", self._std.Empty)

    def servo_cp(self, arm: str, frame_from_reported: Pose, frame: str) -> None:
        message = self._geometry.PoseStamped()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id = frame
        place, turn = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = frame_from_reported.position_m.tolist()
        turn.x, turn.y, turn.z, turn.w = frame_from_reported.quaternion_xyzw.tolist()
        self._publisher(arm, "servo_cp", self._geometry.PoseStamped).publish(message)

    def servo_jaw(self, arm: str, angle_rad: float) -> None:
        message = self._sensor.JointState(name=["jaw"], position=[angle_rad])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher(arm, "jaw/servo_jp", self._sensor.JointState).publish(message)

    def hold(self, arm: str) -> None:
        self._publisher(arm, "hold", self._std.Empty).publish(self._std.Empty())

    def now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def lost(self) -> str:
        return "" if self._context.ok() else "ROS 2 was shut down"

    def commanders(self, arm: str) -> tuple[str, ...] | None:
        own = self._node.get_name()
        found = {
            end.node_name
            for topic in ("servo_cp", "servo_jp", "servo_jr", "move_cp", "move_jp")
            for end in self._node.get_publishers_info_by_topic(f"/{arm}/{topic}")
        }
        return tuple(sorted(found - {own}))

    def overheard(self, arm: str) -> str:
        # Messages of ROS 2 do not say who sent them.
        return ""

    def close(self) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._rclpy.shutdown(context=self._context)

    def _publisher(self, arm: str, topic: str, kind: Any) -> Any:
        if (arm, topic) not in self._publishers:
            made = self._node.create_publisher(kind, f"/{arm}/{topic}", _DEPTH)
            self._publishers[arm, topic] = made
        return self._publishers[arm, topic]


def _stamp_s(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def _module(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ImportError as error:
        raise RosMissing(f"transport ros2 needs {name}, which was not found: {INSTALL}") from error
