"""The topics of one arm, as a dVRK has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from threading import RLock
from typing import Any

import numpy as np

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.psm import Psm, PsmReading
from defras_bt.dvrk.stand_in.refusal import Refused
from defras_bt.dvrk.stand_in.ros_messages import RosMessages, pose_of, twist_of
from defras_bt.dvrk.transport.crtk_messages import crtk_messages
from defras_sim.arm.dh import JOINT_NAMES
from defras_sim.geometry import Floats

_QUEUE = 10


class ArmTopics:
    """Publishes what an arm measures, and hands it the goals that come in.

    Goals come on threads of rospy; ``lock`` keeps them apart from the arm's own time.
    """

    def __init__(
        self,
        rospy: Any,
        arm: Psm,
        name: str,
        lock: RLock,
        stamp_s: Callable[[], float],
        measure_force_n: Callable[[], Floats],
    ) -> None:
        """``name``: that of the topics, as PSM1. ``stamp_s`` gives the ROS time now;
        ``measure_force_n`` the force (3,) along the reported frame's axes."""
        self._arm, self._name, self._lock = arm, name, lock
        self._stamp_s = stamp_s
        self._measure_force_n = measure_force_n
        self._messages = RosMessages()
        self._crtk = crtk_messages()
        self._operating: tuple[str, bool, bool] | None = None
        self._last_stamp_s = 0.0
        geometry, sensor = ros_module("geometry_msgs.msg"), ros_module("sensor_msgs.msg")
        self._out: dict[str, Any] = {}

        def out(topic: str, kind: Any, *, latched: bool = False) -> None:
            self._out[topic] = rospy.Publisher(
                f"/{name}/{topic}", kind, queue_size=_QUEUE, latch=latched, tcp_nodelay=True
            )

        for topic in ("measured_js", "setpoint_js", "jaw/measured_js", "jaw/setpoint_js"):
            out(topic, sensor.JointState)
        for topic in ("measured_cp", "setpoint_cp", "local/measured_cp", "local/setpoint_cp"):
            out(topic, geometry.PoseStamped)
        out("measured_cv", geometry.TwistStamped)
        out("body/measured_cf", geometry.WrenchStamped)
        out("operating_state", self._crtk.OperatingState, latched=True)
        out("error", self._crtk.StringStamped)
        out("trajectory_j/ratio", ros_module("std_msgs.msg").Float64, latched=True)
        self._listen(rospy)

    def publish(self) -> None:
        """Everything that an arm publishes in one period."""
        with self._lock:
            reading, stamp_s = self._arm.reading(), self._fresh_stamp_s()
        self._publish_state(reading, stamp_s)
        self._publish_motion(reading, stamp_s)

    def _publish_state(self, reading: PsmReading, stamp_s: float) -> None:
        now = reading.operating
        told = (now.state, now.is_homed, now.is_busy)
        if told == self._operating:
            return
        self._operating = told
        header = self._messages.header(stamp_s)
        self._out["operating_state"].publish(self._crtk.OperatingState(header, *told))

    def _publish_motion(self, reading: PsmReading, stamp_s: float) -> None:
        make, out, base = self._messages, self._out, f"{self._name}_base"
        joints = (reading.measured_joints.tolist(), reading.measured_speeds.tolist())
        out["measured_js"].publish(make.joints(stamp_s, JOINT_NAMES, *joints))
        setpoint = reading.setpoint_joints.tolist()
        out["setpoint_js"].publish(make.joints(stamp_s, JOINT_NAMES, setpoint))
        out["jaw/measured_js"].publish(make.joints(stamp_s, ["jaw"], [reading.jaw_rad], [0.0]))
        jaw = make.joints(stamp_s, ["jaw"], [reading.jaw_setpoint_rad])
        out["jaw/setpoint_js"].publish(jaw)
        for topic, pose in (
            ("measured_cp", reading.measured),
            ("setpoint_cp", reading.setpoint),
        ):
            message = make.pose(stamp_s, base, pose)
            out[topic].publish(message)
            out[f"local/{topic}"].publish(message)
        out["measured_cv"].publish(make.twist(stamp_s, base, reading.twist))
        out["body/measured_cf"].publish(make.wrench(stamp_s, self._name, self._measure_force_n()))

    def _fresh_stamp_s(self) -> float:
        """Now, strictly after the last stamp: a state counts only if its stamp is newer."""
        self._last_stamp_s = max(self._stamp_s(), self._last_stamp_s + 1e-6)
        return self._last_stamp_s

    def _listen(self, rospy: Any) -> None:
        geometry, sensor = ros_module("geometry_msgs.msg"), ros_module("sensor_msgs.msg")
        std, arm = ros_module("std_msgs.msg"), self._arm
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
            "state_command": (
                self._crtk.StringStamped,
                lambda m: arm.state_command(m.string),
            ),
            "trajectory_j/set_ratio": (std.Float64, lambda m: self._set_ratio(float(m.data))),
        }
        for topic, (kind, act) in goals.items():
            rospy.Subscriber(f"/{self._name}/{topic}", kind, self._heeding(act), tcp_nodelay=True)

    def _set_ratio(self, ratio: float) -> None:
        self._arm.set_ratio(ratio)
        self._out["trajectory_j/ratio"].publish(ratio)

    def _heeding(self, act: Callable[[Any], None]) -> Callable[[Any], None]:
        def heed(message: Any) -> None:
            try:
                with self._lock:
                    act(message)
                    reading, stamp_s = self._arm.reading(), self._fresh_stamp_s()
                    # A move makes the arm busy before anything else is heard of it.
                    self._publish_state(reading, stamp_s)
            except Refused as refused:
                self.say(str(refused))

        return heed

    def say(self, what: str) -> None:
        """Put a sentence on the arm's error topic."""
        header = self._messages.header(self._stamp_s())
        self._out["error"].publish(self._crtk.StringStamped(header, f"{self._name}: {what}"))


def _one(message: Any) -> float:
    if len(message.position) != 1:
        raise Refused(f"jaw goal refused: it needs one position, not {len(message.position)}")
    return float(message.position[0])
