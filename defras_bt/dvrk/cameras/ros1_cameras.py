"""The cameras of a set-up over ROS 1."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from threading import Lock
from typing import Any

import numpy as np

from defras_bt.dvrk.camera_settings import Cameras, DepthCamera, Endoscope
from defras_bt.dvrk.camera_source import CameraReadings
from defras_bt.dvrk.cameras.depth_pictures import SAME_MOMENT_S, cloud_of
from defras_bt.dvrk.cameras.image_messages import decode_depth, decode_intrinsics, decode_picture
from defras_bt.dvrk.cameras.point_cloud import ColouredCloud, decode_cloud
from defras_bt.dvrk.cameras.tissue_cloud import TissueFilter
from defras_bt.dvrk.cameras.unusable import Unusable, require_frame, stamp_s
from defras_bt.dvrk.registering.registration import CameraName
from defras_bt.dvrk.ros_packages import ros_module
from defras_bt.sensing.cloud import Workspace
from defras_bt.sensing.roi import roi_visibility
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import CameraImage, PointCloud

_LARGEST_MESSAGE = 2**25
"""Bytes. With less room than a message takes, rospy falls behind by whole messages."""


CLOCKS_DIFFER_S = 0.5
"""Clocks of two computers may differ by so much before a stamp counts as one of the future."""


class Ros1Cameras:
    """Listens to the topics of a set-up's cameras; the process must be a ROS node already.

    Messages are decoded on rospy's threads, so :meth:`latest` only reads.
    """

    def __init__(
        self, cameras: Cameras, tissue_from: Mapping[CameraName, Pose], scene: Scene
    ) -> None:
        """``tissue_from``: tissue_from_camera of every camera of the set-up, as registered.

        Raises:
            KeyError: a camera is not registered.
            RosMissing: ROS 1 is not installed.
        """
        self._rospy = ros_module("rospy")
        self._sensor = ros_module("sensor_msgs.msg")
        self._cameras, self._scene = cameras, scene
        self._lock = Lock()
        self._readings = CameraReadings()
        self._faults: dict[str, str] = {}
        self._untold: dict[str, str] = {}
        """Faults that nobody has asked for yet, over or not."""
        self._act: Callable[[], None] = lambda: None
        self._last_s: dict[str, float] = {}
        self._parts: dict[str, Any] = {}
        """Latest depth, colour and info messages, until they make a cloud together."""
        self._listening: list[Any] = []
        if cameras.depth is not None:
            pose = tissue_from["depth"]
            colours = cameras.colours.calibration
            self._filter = TissueFilter(pose, Workspace.of(scene), colours)
            self._hear_depth(cameras.depth)
        if cameras.endoscope is not None:
            self._endoscope_pose = tissue_from["endoscope"]
            self._hear_endoscope(cameras.endoscope)

    def latest(self) -> CameraReadings:
        """The newest readings; never waits. A fault is told at least once, however short it was."""
        with self._lock:
            faults, self._untold = {**self._untold, **self._faults}, {}
            return replace(self._readings, faults=faults)

    def now_s(self) -> float:
        """ROS time."""
        return float(self._rospy.get_time())

    def when_unusable(self, act: Callable[[], None]) -> None:
        """Have ``act`` called, on rospy's threads, as soon as a sound reading is no more."""
        self._act = act

    def close(self) -> None:
        """Listen no more."""
        for subscriber in self._listening:
            subscriber.unregister()
        self._listening.clear()

    def _hear_depth(self, camera: DepthCamera) -> None:
        if camera.cloud is not None:
            self._listen(camera.cloud, self._sensor.PointCloud2, partial(self._cloud, camera))
            return
        for part, topic, kind in (
            ("depth", camera.depth, self._sensor.Image),
            ("colour", camera.colour, self._sensor.Image),
            ("info", camera.info, self._sensor.CameraInfo),
        ):
            self._listen(topic or "", kind, partial(self._depth_part, camera, part))

    def _hear_endoscope(self, camera: Endoscope) -> None:
        self._listen(camera.image, self._sensor.Image, partial(self._picture, camera))
        self._listen(camera.info, self._sensor.CameraInfo, partial(self._keep, "endoscope_info"))

    def _listen(self, topic: str, kind: Any, hear: Callable[[Any], None]) -> None:
        self._listening.append(
            self._rospy.Subscriber(
                topic, kind, hear, queue_size=1, buff_size=_LARGEST_MESSAGE, tcp_nodelay=True
            )
        )

    def _keep(self, part: str, message: Any) -> None:
        with self._lock:
            self._parts[part] = message

    def _cloud(self, camera: DepthCamera, message: Any) -> None:
        self._sensed("cloud", message, camera.frame, lambda: decode_cloud(message))

    def _depth_part(self, camera: DepthCamera, part: str, message: Any) -> None:
        self._keep(part, message)
        with self._lock:
            parts = [self._parts.get(name) for name in ("depth", "colour", "info")]
            depth, colour, info = parts
            if depth is None or colour is None or info is None:
                return
            if abs((depth.header.stamp - colour.header.stamp).to_sec()) > SAME_MOMENT_S:
                return  # the other one of this moment is still on its way
            del self._parts["depth"], self._parts["colour"]

        def decode() -> ColouredCloud:
            return cloud_of(decode_depth(depth), decode_picture(colour), decode_intrinsics(info))

        self._sensed("cloud", depth, camera.frame, decode)

    def _sensed(
        self, name: str, message: Any, frame: str, decode: Callable[[], ColouredCloud]
    ) -> None:
        try:
            require_frame(message, frame)
            taken_s = self._newer_s(name, message)
            cloud = PointCloud(taken_s, self._filter.points_m(decode()))
        except Unusable as fault:
            self._fault(name, fault)
            return
        with self._lock:
            self._faults.pop(name, None)
            self._readings = replace(self._readings, cloud=cloud)

    def _picture(self, camera: Endoscope, message: Any) -> None:
        try:
            require_frame(message, camera.frame)
            taken_s = self._newer_s("endoscope", message)
            with self._lock:
                info = self._parts.get("endoscope_info")
            if info is None:
                raise Unusable(f"nothing came on {camera.info} yet, which says how it sees")
            image = CameraImage(
                stamp_s=taken_s,
                rgb=decode_picture(message),
                depth_m=None,
                intrinsics=decode_intrinsics(info),
                tissue_from_camera=self._endoscope_pose,
            )
            share = self._visibility(image)
        except Unusable as fault:
            self._fault("endoscope", fault)
            return
        with self._lock:
            self._faults.pop("endoscope", None)
            self._readings = replace(
                self._readings,
                endoscope_image=image,
                roi_visibility=share,
                roi_visibility_stamp_s=taken_s,
            )

    def _visibility(self, image: CameraImage) -> float:
        try:
            return roi_visibility(image, self._scene, self._cameras.colours.calibration)
        except ValueError as error:
            raise Unusable(str(error)) from error

    def _newer_s(self, name: str, message: Any) -> float:
        """The stamp, neither of the future nor older than the last one."""
        taken_s = stamp_s(message)
        ahead_s = taken_s - self.now_s()
        if ahead_s > CLOCKS_DIFFER_S:
            # Not remembered: one wrong stamp must not shut out all that follow.
            raise Unusable(f"it is stamped {ahead_s:.3f} s in the future; are the clocks set?")
        last_s = self._last_s.get(name, -np.inf)
        if taken_s < last_s:
            raise Unusable(f"its stamps run backwards, by {last_s - taken_s:.3f} s")
        self._last_s[name] = taken_s
        return taken_s

    def _fault(self, name: str, fault: Unusable) -> None:
        with self._lock:
            is_new = name not in self._faults
            self._faults[name] = f"the {name} cannot be used: {fault}"
            self._untold[name] = self._faults[name]
        if is_new:
            self._act()
