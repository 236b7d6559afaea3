"""CRTK over ROS 1."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.settings import Ros1Transport
from defras_bt.dvrk.transport.crtk_messages import crtk_messages
from defras_bt.dvrk.transport.lifeline import Lifeline
from defras_bt.dvrk.transport.messages import (
    JOINTS,
    POSES,
    STATES,
    WRENCHES,
    Message,
)
from defras_bt.dvrk.transport.ros1_node import address, join, node_lives
from defras_bt.dvrk.transport.ros_reading import StampOf, joints, pose, state, wrench
from defras_bt.dvrk.transport.transport import Receive
from defras_sim.geometry import Pose

_QUEUE = 20
_COMMANDS = (
    *("servo_cp", "servo_cv", "servo_jp", "servo_jr", "servo_jf"),
    *("move_cp", "move_jp", "move_jr"),
)
_JUST_S = 0.3
"""So long somebody who commanded an arm is taken to go on."""


class Ros1:
    """A node that listens to arms and commands them."""

    def __init__(self, settings: Ros1Transport, node: str = "defras") -> None:
        """
        Raises:
            RosMissing: ROS 1 is not installed.
            ConnectionFailed: no master answers.
        """
        self._rospy = join(settings, node)
        self._geometry = ros_module("geometry_msgs.msg")
        self._sensor = ros_module("sensor_msgs.msg")
        self._std = ros_module("std_msgs.msg")
        self._uri = settings.master_uri
        self.simulated_clock = bool(self._rospy.get_param("/use_sim_time", False))
        self._lifeline = Lifeline(*address(settings.master_uri))
        self._publishers: dict[tuple[str, str], Any] = {}
        self._making = threading.Lock()
        self._subscribers: list[Any] = []
        self._newest_s = 0.0
        self._overheard: dict[str, tuple[str, float]] = {}
        """By arm: who else commanded it last, in words, and when."""

    def listen(self, arm: str, topic: str, receive: Receive) -> None:
        kind, read = self._reader(topic)

        def hear(message: Any) -> None:
            said = read(message, _stamp_s)
            self._newest_s = max(self._newest_s, said.stamp_s)
            receive(said)

        self._subscribers.append(
            self._rospy.Subscriber(
                f"/{arm}/{topic}", kind, hear, queue_size=_QUEUE, tcp_nodelay=True
            )
        )

    def announce(self, arm: str) -> None:
        self._publisher(arm, "servo_cp", self._geometry.PoseStamped)
        self._publisher(arm, "jaw/servo_jp", self._sensor.JointState)
        self._publisher(arm, "hold", self._std.Empty)
        for command in _COMMANDS:
            self._subscribers.append(
                self._rospy.Subscriber(
                    f"/{arm}/{command}",
                    self._rospy.AnyMsg,
                    partial(self._overhear, arm, command),
                    queue_size=_QUEUE,
                    tcp_nodelay=True,
                )
            )

    def servo_cp(self, arm: str, frame_from_reported: Pose, frame: str) -> None:
        message = self._geometry.PoseStamped()
        message.header.stamp = self._rospy.Time.now()
        message.header.frame_id = frame
        place, turn = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = frame_from_reported.position_m.tolist()
        turn.x, turn.y, turn.z, turn.w = frame_from_reported.quaternion_xyzw.tolist()
        self._publisher(arm, "servo_cp", self._geometry.PoseStamped).publish(message)

    def servo_jaw(self, arm: str, angle_rad: float) -> None:
        message = self._sensor.JointState(name=["jaw"], position=[angle_rad])
        message.header.stamp = self._rospy.Time.now()
        self._publisher(arm, "jaw/servo_jp", self._sensor.JointState).publish(message)

    def hold(self, arm: str) -> None:
        self._publisher(arm, "hold", self._std.Empty).publish(self._std.Empty())

    def now_s(self) -> float:
        now_s = float(self._rospy.get_time())
        # A simulation's clock comes as messages too, and may come after those that it stamped.
        return max(now_s, self._newest_s) if self.simulated_clock else now_s

    def lost(self) -> str:
        return f"the ROS master at {self._uri} is gone" if self._lifeline.cut else ""

    def commanders(self, arm: str) -> tuple[str, ...] | None:
        code, why, state = self._rospy.get_master().getSystemState()
        if code != 1:
            raise OSError(f"the ROS master does not tell who publishes what: {why}")
        topics = {f"/{arm}/{command}" for command in _COMMANDS}
        nodes = {node for topic, whose in state[0] if topic in topics for node in whose}
        others = nodes - {self._rospy.get_name()}
        # A node that was killed stays on the master's list for ever.
        return tuple(sorted(node for node in others if node_lives(self._uri, node)))

    def overheard(self, arm: str) -> str:
        who, when_s = self._overheard.get(arm, ("", float("-inf")))
        return who if self.now_s() - when_s < _JUST_S else ""

    def close(self) -> None:
        for one in (*self._subscribers, *self._publishers.values()):
            one.unregister()
        self._subscribers.clear()
        self._publishers.clear()
        self._lifeline.close()
        self._rospy.signal_shutdown("defras has ended")

    def _overhear(self, arm: str, command: str, message: Any) -> None:
        # rospy tells the sender of a message nowhere else.
        node = message._connection_header.get("callerid", "somebody without a name")
        if node != self._rospy.get_name():
            self._overheard[arm] = (f"{node} commands it as well ({command})", self.now_s())

    def _publisher(self, arm: str, topic: str, kind: Any) -> Any:
        found = self._publishers.get((arm, topic))
        if found is None:
            with self._making:
                # With a queue, a subscriber that hangs keeps nobody else waiting.
                found = self._publishers.setdefault(
                    (arm, topic),
                    self._rospy.Publisher(f"/{arm}/{topic}", kind, queue_size=1, tcp_nodelay=True),
                )
        return found

    def _reader(self, topic: str) -> tuple[Any, Callable[[Any, StampOf], Message]]:
        """The type of a topic's messages and what makes ours of them."""
        if topic in POSES:
            return self._geometry.PoseStamped, pose
        if topic in JOINTS:
            return self._sensor.JointState, joints
        if topic in WRENCHES:
            return self._geometry.WrenchStamped, wrench
        if topic in STATES:
            return crtk_messages().OperatingState, state
        valid = ", ".join((*POSES, *JOINTS, *WRENCHES, *STATES))
        raise ValueError(f"no CRTK topic {topic!r} is listened to; valid are {valid}")


def _stamp_s(message: Any) -> float:
    return float(message.header.stamp.to_sec())
