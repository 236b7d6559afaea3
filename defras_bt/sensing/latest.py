"""The newest reading of every sensor, whatever order messages arrive in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isinf
from typing import Any, TypeVar

import numpy as np

from defras_bt.sensing.freshness import age_s
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmObservation, CameraImage, Observation, PointCloud

AnyReading = TypeVar("AnyReading", ArmObservation, PointCloud, CameraImage)


class LatestReadings:
    """Lets through what is new, and holds on to the newest reading where something else comes.

    A reading older than one seen before (messages overtook each other) is replaced by that one. So
    is a depth reading that repeats the one before to the last bit under a newer stamp: a camera
    with noise never measures the same twice, but a driver whose camera hangs delivers it. The
    reading held on to keeps its stamp and so ages, until the freshness guard trips.

    A stamp from the future is let through, for freshness to judge, but not remembered: one wrong
    stamp must not shut out all that follow.
    """

    def __init__(self, scene: Scene) -> None:
        self._noisy = scene.depth_camera.noise_sd_m > 0.0
        self._newest: dict[str, object] = {}
        self._visibility: tuple[float, float] | None = None
        """Share and stamp of the newest visibility."""

    def update(self, observation: Observation) -> Observation:
        """The observation with every reading as new as it was ever seen."""
        now_s = observation.time_s
        arms: Mapping[str, ArmObservation] = {
            name: self._newer(name, arm, now_s) for name, arm in observation.arms.items()
        }
        share, stamp_s = self._newer_visibility(observation)
        cloud, depth = observation.cloud, observation.depth_image
        picture = observation.endoscope_image
        newest: dict[str, Any] = {
            "cloud": None if cloud is None else self._newer("cloud", cloud, now_s),
            "depth_image": None if depth is None else self._newer("depth_image", depth, now_s),
            "endoscope_image": None if picture is None else self._newer("picture", picture, now_s),
            "roi_visibility": share,
            "roi_visibility_stamp_s": stamp_s,
        }
        other: dict[str, Any] = {
            what: new for what, new in newest.items() if getattr(observation, what) is not new
        }
        if any(arms[name] is not arm for name, arm in observation.arms.items()):
            other["arms"] = arms
        # Most often everything is new, and a copy of an observation takes its time.
        return replace(observation, **other) if other else observation

    def _newer(self, name: str, reading: AnyReading, now_s: float) -> AnyReading:
        if isinf(age_s(reading.stamp_s, now_s)):
            return reading
        last = self._newest.get(name)
        if isinstance(last, type(reading)) and (
            reading.stamp_s < last.stamp_s or (self._noisy and _repeats(reading, last))
        ):
            return last
        self._newest[name] = reading
        return reading

    def _newer_visibility(self, observation: Observation) -> tuple[float | None, float | None]:
        share, stamp_s = observation.roi_visibility, observation.roi_visibility_stamp_s
        if share is None or stamp_s is None or isinf(age_s(stamp_s, observation.time_s)):
            return share, stamp_s
        if self._visibility is None or stamp_s >= self._visibility[1]:
            self._visibility = (share, stamp_s)
        return self._visibility


def _repeats(reading: object, last: object) -> bool:
    """Whether a depth reading is the one before under another stamp."""
    if isinstance(reading, PointCloud) and isinstance(last, PointCloud):
        return _equal(reading.points_m, last.points_m)
    if isinstance(reading, CameraImage) and isinstance(last, CameraImage):
        depth_m, before_m = reading.depth_m, last.depth_m
        return (
            depth_m is not None
            and before_m is not None
            and np.array_equal(depth_m, before_m, equal_nan=True)
        )
    return False


def _equal(points_m: Floats, others_m: Floats) -> bool:
    """As numpy's, which compares all numbers where most often the first ones differ."""
    if points_m.shape != others_m.shape or points_m.flat[:3].tolist() != others_m.flat[:3].tolist():
        return False
    return np.array_equal(points_m, others_m)
