"""Readings as standard ROS 2 messages. Stamps are world time, frames are the tissue's."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from defras_sim.geometry import Floats, Pose

TYPES = get_typestore(Stores.ROS2_HUMBLE)
FRAME = "tissue"
JOINTS = ("yaw", "pitch", "insertion", "roll", "wrist_pitch", "wrist_yaw")

POSE = "geometry_msgs/msg/PoseStamped"
JOINT = "sensor_msgs/msg/JointState"
CLOUD = "sensor_msgs/msg/PointCloud2"
FLAG = "std_msgs/msg/Bool"
NUMBER = "std_msgs/msg/Float64"
TEXT = "std_msgs/msg/String"
WRENCH = "geometry_msgs/msg/WrenchStamped"

_FLOAT32 = 7


def nanoseconds(time_s: float) -> int:
    return round(time_s * 1e9)


def definition(message_type: str) -> str:
    """The text that tells a reader how the message is built."""
    text: str = TYPES.generate_msgdef(message_type, ros_version=2)[0]
    return text


def encoded(message_type: str, message: Any) -> bytes:
    return bytes(TYPES.serialize_cdr(message, message_type))


def pose_message(stamp_s: float, pose: Pose, quaternion_xyzw: Floats) -> bytes:
    """``quaternion_xyzw`` (4,) is that of the pose; whoever writes many knows most from before."""
    types = TYPES.types
    position = types["geometry_msgs/msg/Point"](*map(float, pose.position_m))
    orientation = types["geometry_msgs/msg/Quaternion"](*map(float, quaternion_xyzw))
    placed = types["geometry_msgs/msg/Pose"](position=position, orientation=orientation)
    return encoded(POSE, types[POSE](header=_header(stamp_s), pose=placed))


def joint_message(stamp_s: float, names: tuple[str, ...], position: Floats) -> bytes:
    nothing = np.zeros(0)
    joints = np.asarray(position, float)
    if len(joints) != len(names):
        raise ValueError(f"{len(joints)} joint positions for the joints {', '.join(names)}")
    message = TYPES.types[JOINT](_header(stamp_s), list(names), joints, nothing, nothing)
    return encoded(JOINT, message)


def cloud_message(stamp_s: float, points_m: Floats) -> bytes:
    """Points (n, 3) as 32-bit floats x, y, z."""
    types = TYPES.types
    points = np.ascontiguousarray(points_m, np.float32).reshape(-1, 3)
    fields = [
        types["sensor_msgs/msg/PointField"](name, 4 * i, _FLOAT32, 1)
        for i, name in enumerate("xyz")
    ]
    message = types[CLOUD](
        header=_header(stamp_s),
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(points),
        data=points.view(np.uint8).ravel(),
        is_dense=bool(np.isfinite(points).all()),
    )
    return encoded(CLOUD, message)


def force_message(stamp_s: float, force_n: Floats) -> bytes:
    """A force (3,) along the axes of the tissue frame, without a torque."""
    types = TYPES.types
    vector = types["geometry_msgs/msg/Vector3"]
    wrench = types["geometry_msgs/msg/Wrench"](
        force=vector(*map(float, force_n)), torque=vector(0.0, 0.0, 0.0)
    )
    return encoded(WRENCH, types[WRENCH](header=_header(stamp_s), wrench=wrench))


def flag_message(value: bool) -> bytes:
    return encoded(FLAG, TYPES.types[FLAG](bool(value)))


def number_message(value: float) -> bytes:
    return encoded(NUMBER, TYPES.types[NUMBER](float(value)))


def text_message(text: str) -> bytes:
    return encoded(TEXT, TYPES.types[TEXT](text))


def _header(stamp_s: float) -> Any:
    seconds, rest = divmod(nanoseconds(stamp_s), 10**9)
    stamp = TYPES.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)
    return TYPES.types["std_msgs/msg/Header"](stamp=stamp, frame_id=FRAME)
