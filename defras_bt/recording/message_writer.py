"""Messages into an MCAP file: a channel for each topic when it is first heard of."""

from __future__ import annotations

import numpy as np

from defras_bt.recording import ros_messages as ros
from defras_bt.recording.mcap_file import McapFile
from defras_sim.geometry import Floats, Pose
from defras_sim.worlds.protocol import ArmObservation


class MessageWriter:
    """Writes messages to ``file``, which stays whose it is."""

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._channels: dict[str, int] = {}
        self._turned: dict[str, tuple[Floats, Floats]] = {}
        """Last rotation (3, 3) and quaternion (4,) by topic: arms turn in few ticks."""

    def write(
        self, topic: str, message_type: str, now_s: float, stamp_s: float, message: bytes
    ) -> None:
        """A message that was heard at ``now_s`` of what was measured at ``stamp_s``."""
        if topic not in self._channels:
            definition = ros.definition(message_type)
            self._channels[topic] = self._file.add_channel(topic, message_type, definition)
        times = (ros.nanoseconds(now_s), ros.nanoseconds(stamp_s))
        self._file.write(self._channels[topic], *times, message)

    def write_arm(self, name: str, now_s: float, seen: ArmObservation) -> None:
        """All topics of the arm ``name``, under its name in capitals; what is None has none."""
        arm, stamp_s = f"/{name.upper()}", seen.stamp_s
        for topic, pose in (
            (f"{arm}/measured_cp", seen.tissue_from_tip),
            (f"{arm}/setpoint_cp", seen.setpoint_tissue_from_tip),
        ):
            message = ros.pose_message(stamp_s, pose, self._quaternion_xyzw(topic, pose))
            self.write(topic, ros.POSE, now_s, stamp_s, message)
        for topic, joints in (
            (f"{arm}/measured_js", seen.joints),
            (f"{arm}/setpoint_js", seen.setpoint_joints),
        ):
            if joints is not None:
                message = ros.joint_message(stamp_s, ros.JOINTS, joints)
                self.write(topic, ros.JOINT, now_s, stamp_s, message)
        jaw = ros.joint_message(stamp_s, ("jaw",), np.array([seen.jaw_rad]))
        self.write(f"{arm}/jaw/measured_js", ros.JOINT, now_s, stamp_s, jaw)
        if seen.force_n is not None:
            message = ros.force_message(stamp_s, seen.force_n)
            self.write(f"{arm}/body/measured_cf", ros.WRENCH, now_s, stamp_s, message)
        if seen.grasped is not None:
            message = ros.flag_message(seen.grasped)
            self.write(f"{arm}/grasped", ros.FLAG, now_s, stamp_s, message)

    def _quaternion_xyzw(self, topic: str, pose: Pose) -> Floats:
        last = self._turned.get(topic)
        if last is None or not np.array_equal(last[0], pose.rotation):
            last = self._turned[topic] = (pose.rotation.copy(), pose.quaternion_xyzw)
        return last[1]
