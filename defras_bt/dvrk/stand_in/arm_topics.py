"""What one arm publishes, as a dVRK does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.delivery import Delivery
from defras_bt.dvrk.stand_in.operating import Operating
from defras_bt.dvrk.stand_in.psm import PsmReading
from defras_bt.dvrk.stand_in.ros_messages import RosMessages
from defras_bt.dvrk.transport.crtk_messages import crtk_messages
from defras_sim.arm.dh import JOINT_NAMES
from defras_sim.geometry import Floats
from defras_sim.scene import ArmName

_QUEUE = 10


class ArmTopics:
    """The topics of one arm. Stamps are ROS time, strictly newer from one call to the next."""

    def __init__(self, rospy: Any, arm: ArmName, delivery: Delivery) -> None:
        self._arm, self._name, self._delivery = arm, arm.upper(), delivery
        self._messages = RosMessages()
        self._crtk = crtk_messages()
        self._told: Operating | None = None
        self._last_stamp_s = 0.0
        geometry, sensor = ros_module("geometry_msgs.msg"), ros_module("sensor_msgs.msg")

        def out(topic: str, kind: Any, *, latched: bool = False) -> Any:
            return rospy.Publisher(
                f"/{self._name}/{topic}", kind, queue_size=_QUEUE, latch=latched, tcp_nodelay=True
            )

        joints = ("measured_js", "setpoint_js", "jaw/measured_js", "jaw/setpoint_js")
        poses = ("measured_cp", "setpoint_cp", "local/measured_cp", "local/setpoint_cp")
        self._out = {topic: out(topic, sensor.JointState) for topic in joints}
        self._out |= {topic: out(topic, geometry.PoseStamped) for topic in poses}
        self._out["measured_cv"] = out("measured_cv", geometry.TwistStamped)
        self._out["body/measured_cf"] = out("body/measured_cf", geometry.WrenchStamped)
        # As an event: when something changes, and once more for whoever comes later.
        state = self._crtk.OperatingState
        self._out["operating_state"] = out("operating_state", state, latched=True)
        self._out["error"] = out("error", self._crtk.StringStamped)

    def publish(
        self, reading: PsmReading, force_n: Floats, now_s: float, ros_s: Callable[[], float]
    ) -> None:
        """Everything that an arm publishes in one period, at world time ``now_s``.

        ``force_n`` (3,) along the reported frame's axes; ``ros_s`` gives ROS time.
        """
        self.publish_state(reading.operating, now_s, ros_s)
        make, stamp_s, base = self._messages, self._fresh_s(ros_s), f"{self._name}_base"
        measured = (reading.measured_joints.tolist(), reading.measured_speeds.tolist())
        setpoint = reading.setpoint_joints.tolist()
        jaw, jaw_setpoint = [reading.jaw_rad], [reading.jaw_setpoint_rad]
        for topic, message in (
            ("measured_js", make.joints(stamp_s, JOINT_NAMES, *measured)),
            ("setpoint_js", make.joints(stamp_s, JOINT_NAMES, setpoint)),
            ("jaw/measured_js", make.joints(stamp_s, ["jaw"], jaw)),
            ("jaw/setpoint_js", make.joints(stamp_s, ["jaw"], jaw_setpoint)),
            ("measured_cp", make.pose(stamp_s, base, reading.measured)),
            ("setpoint_cp", make.pose(stamp_s, base, reading.setpoint)),
            ("local/measured_cp", make.pose(stamp_s, base, reading.measured)),
            ("local/setpoint_cp", make.pose(stamp_s, base, reading.setpoint)),
            ("measured_cv", make.twist(stamp_s, base, reading.twist)),
            ("body/measured_cf", make.wrench(stamp_s, self._name, force_n)),
        ):
            self._delivery.deliver(self._arm, self._out[topic], message, now_s)

    def publish_state(self, operating: Operating, now_s: float, ros_s: Callable[[], float]) -> None:
        """The operating state, if it is another one than was told last."""
        if operating == self._told:
            return
        self._told = operating
        header = self._messages.header(self._fresh_s(ros_s))
        message = self._crtk.OperatingState(
            header, operating.state, operating.is_homed, operating.is_busy
        )
        self._delivery.deliver(self._arm, self._out["operating_state"], message, now_s)

    def say(self, what: str, ros_s: Callable[[], float]) -> None:
        """Put a sentence on the arm's error topic."""
        header = self._messages.header(ros_s())
        self._out["error"].publish(self._crtk.StringStamped(header, f"{self._name}: {what}"))

    def _fresh_s(self, ros_s: Callable[[], float]) -> float:
        """Now, but after the last stamp: a state counts only if its stamp is strictly newer."""
        self._last_stamp_s = max(ros_s(), self._last_stamp_s + 1e-6)
        return self._last_stamp_s
