"""What one arm can be told, as a dVRK can."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.psm import Psm
from defras_bt.dvrk.stand_in.refusal import Refused
from defras_bt.dvrk.stand_in.ros_messages import pose_of, twist_of
from defras_bt.dvrk.transport.crtk_messages import crtk_messages

Heed = Callable[[str, Callable[[], None], str], None]
"""Carries out a command of that name, sent by that node; called on rospy's threads."""


def listen(rospy: Any, arm: Psm, name: str, heed: Heed) -> list[Any]:
    """Subscribe to the commands of the arm whose topics begin with ``name``."""
    geometry, sensor = ros_module("geometry_msgs.msg"), ros_module("sensor_msgs.msg")
    std, crtk = ros_module("std_msgs.msg"), crtk_messages()
    goals: Mapping[str, tuple[Any, Callable[[Any], None]]] = {
        "servo_jp": (sensor.JointState, lambda m: arm.servo_jp(np.array(m.position))),
        "servo_jr": (sensor.JointState, lambda m: arm.servo_jr(np.array(m.position))),
        "servo_cp": (geometry.PoseStamped, lambda m: arm.servo_cp(pose_of(m))),
        "servo_cv": (geometry.TwistStamped, lambda m: arm.servo_cv(twist_of(m))),
        "move_jp": (sensor.JointState, lambda m: arm.move_jp(np.array(m.position))),
        "move_jr": (sensor.JointState, lambda m: arm.move_jr(np.array(m.position))),
        "move_cp": (geometry.PoseStamped, lambda m: arm.move_cp(pose_of(m))),
        "jaw/servo_jp": (sensor.JointState, lambda m: arm.jaw_servo_jp(_one(m))),
        "jaw/move_jp": (sensor.JointState, lambda m: arm.jaw_move_jp(_one(m))),
        "hold": (std.Empty, lambda _: arm.hold()),
        "free": (std.Empty, lambda _: arm.free()),
        "state_command": (crtk.StringStamped, lambda m: arm.state_command(m.string)),
        "trajectory_j/set_ratio": (std.Float64, lambda m: arm.set_ratio(float(m.data))),
    }

    def heeding(command: str, act: Callable[[Any], None]) -> Callable[[Any], None]:
        def hear(message: Any) -> None:
            # rospy tells the sender of a message nowhere else.
            node = message._connection_header["callerid"]
            heed(command, lambda: act(message), node)

        return hear

    return [
        rospy.Subscriber(f"/{name}/{command}", kind, heeding(command, act), tcp_nodelay=True)
        for command, (kind, act) in goals.items()
    ]


def _one(message: Any) -> float:
    if len(message.position) != 1:
        raise Refused(f"jaw goal refused: it needs one position, not {len(message.position)}")
    return float(message.position[0])
