"""Messages of the stand-in to and from numbers. Stamps are seconds of the stand-in's ROS clock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.dvrk.stand_in.refusal import Refused
from defras_sim.geometry import Floats, Pose


class RosMessages:
    """Makes messages; the classes are loaded when the first one is made.

    Raises:
        RosMissing: ROS 1 is not installed.
    """

    def __init__(self) -> None:
        self._geometry = ros_module("geometry_msgs.msg")
        self._sensor = ros_module("sensor_msgs.msg")
        self._std = ros_module("std_msgs.msg")
        self._genpy = ros_module("genpy")

    def header(self, stamp_s: float, frame: str = "") -> Any:
        return self._std.Header(stamp=self._genpy.Time.from_sec(stamp_s), frame_id=frame)

    def pose(self, stamp_s: float, frame: str, pose: Pose) -> Any:
        message = self._geometry.PoseStamped(header=self.header(stamp_s, frame))
        at, turn = message.pose.position, message.pose.orientation
        at.x, at.y, at.z = pose.position_m.tolist()
        turn.x, turn.y, turn.z, turn.w = pose.quaternion_xyzw.tolist()
        return message

    def joints(
        self,
        stamp_s: float,
        names: Sequence[str],
        position: Sequence[float],
        velocity: Sequence[float] = (),
    ) -> Any:
        return self._sensor.JointState(
            header=self.header(stamp_s),
            name=list(names),
            position=list(position),
            velocity=list(velocity),
            effort=[],
        )

    def twist(self, stamp_s: float, frame: str, twist: Floats) -> Any:
        message = self._geometry.TwistStamped(header=self.header(stamp_s, frame))
        linear, angular = message.twist.linear, message.twist.angular
        linear.x, linear.y, linear.z = twist[:3].tolist()
        angular.x, angular.y, angular.z = twist[3:].tolist()
        return message

    def wrench(self, stamp_s: float, frame: str, force_n: Floats) -> Any:
        message = self._geometry.WrenchStamped(header=self.header(stamp_s, frame))
        force = message.wrench.force
        force.x, force.y, force.z = force_n.tolist()
        return message

    def picture(self, stamp_s: float, frame: str, rgb: NDArray[np.uint8]) -> Any:
        height, width = rgb.shape[:2]
        return self._sensor.Image(
            header=self.header(stamp_s, frame),
            height=height,
            width=width,
            encoding="rgb8",
            is_bigendian=0,
            step=3 * width,
            data=np.ascontiguousarray(rgb).tobytes(),
        )

    def depth(self, stamp_s: float, frame: str, depth_m: Floats) -> Any:
        height, width = depth_m.shape
        return self._sensor.Image(
            header=self.header(stamp_s, frame),
            height=height,
            width=width,
            encoding="32FC1",
            is_bigendian=0,
            step=4 * width,
            data=depth_m.astype("<f4").tobytes(),
        )

    def camera_info(
        self, stamp_s: float, frame: str, intrinsics: Floats, shape: tuple[int, int]
    ) -> Any:
        projection = np.hstack([intrinsics, np.zeros((3, 1))])
        return self._sensor.CameraInfo(
            header=self.header(stamp_s, frame),
            height=shape[0],
            width=shape[1],
            distortion_model="plumb_bob",
            D=[0.0] * 5,
            K=intrinsics.ravel().tolist(),
            R=np.eye(3).ravel().tolist(),
            P=projection.ravel().tolist(),
        )

    def cloud(self, stamp_s: float, frame: str, points: Floats, rgb: NDArray[np.uint8]) -> Any:
        """An organised cloud (h, w, 3) with colours (h, w, 3), NaN where nothing was measured."""
        height, width = points.shape[:2]
        rows = np.zeros((height, width), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
        rows["x"], rows["y"], rows["z"] = np.moveaxis(points, -1, 0)
        red, green, blue = np.moveaxis(rgb.astype(np.uint32), -1, 0)
        rows["rgb"] = (red << 16) | (green << 8) | blue
        field = self._sensor.PointField
        fields = [
            field(name=name, offset=4 * i, datatype=field.FLOAT32, count=1)
            for i, name in enumerate(("x", "y", "z", "rgb"))
        ]
        return self._sensor.PointCloud2(
            header=self.header(stamp_s, frame),
            height=height,
            width=width,
            fields=fields,
            is_bigendian=False,
            point_step=16,
            row_step=16 * width,
            data=rows.tobytes(),
            is_dense=False,
        )


def pose_of(message: Any) -> Pose:
    """The pose of a PoseStamped.

    Raises:
        Refused: its orientation is no rotation.
    """
    at, turn = message.pose.position, message.pose.orientation
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w])
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1.0) < 0.01:
        raise Refused(f"goal refused: its quaternion has length {length:.3g} instead of 1")
    rotation = Rotation.from_quat(quaternion).as_matrix()
    return Pose(np.array([at.x, at.y, at.z]), rotation)


def twist_of(message: Any) -> Floats:
    """(6,): linear, then angular."""
    linear, angular = message.twist.linear, message.twist.angular
    return np.array([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])
