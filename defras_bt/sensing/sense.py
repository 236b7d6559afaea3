"""From what a world delivers to what the executive works with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.sensing.cloud import Workspace, tissue_points_m
from defras_bt.sensing.colours import DEFAULT_COLOURS, ColourCalibration
from defras_bt.sensing.roi import roi_visibility
from defras_bt.sensing.usable import usable_points
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import Observation, PointCloud

MIN_CLOUD_POINTS = 20
"""Fewer points than this say nothing about a tissue's shape."""


@dataclass(frozen=True)
class SensedObservation(Observation):
    """An observation with cloud and visibility filled in where they could be.

    ``faults`` says in sentences what could not be sensed; a missing cloud or visibility is always
    explained here. ``dropped_points`` counts cloud points left out because they were not finite.
    """

    faults: tuple[str, ...] = ()
    dropped_points: int = 0


def sense(
    observation: Observation,
    scene: Scene,
    colours: ColourCalibration = DEFAULT_COLOURS,
    workspace: Workspace | None = None,
) -> SensedObservation:
    """Fill in cloud and region visibility; what a world delivers ready-made passes through.

    Bad data never raises: it ends up as None with a sentence in ``faults``, and whoever needs the
    reading has to treat None as a tripped guard. What was sensed already, as in a recording, stays.
    ``workspace`` is that of the scene, for those who sense every tick.
    """
    if isinstance(observation, SensedObservation):
        return observation
    share, stamp_s, unseen = _visibility(observation, scene, colours)
    cloud, dropped, unmeasured = _cloud(
        observation, scene, colours, workspace or Workspace.of(scene)
    )
    return SensedObservation(
        time_s=observation.time_s,
        arms=observation.arms,
        cloud=cloud,
        depth_image=observation.depth_image,
        endoscope_image=observation.endoscope_image,
        roi_visibility=share,
        roi_visibility_stamp_s=stamp_s,
        stopped=observation.stopped,
        faults=tuple(fault for fault in (unseen, unmeasured) if fault),
        dropped_points=dropped,
    )


def _cloud(
    observation: Observation, scene: Scene, colours: ColourCalibration, workspace: Workspace
) -> tuple[PointCloud | None, int, str]:
    """The cloud, how many points were not finite, and why there is no cloud ("" if there is)."""
    cloud, image = observation.cloud, observation.depth_image
    if cloud is None and image is None:
        return None, 0, "no cloud: the world gives neither a cloud nor a depth picture"
    if cloud is None and image is not None:
        try:
            cloud = PointCloud(image.stamp_s, tissue_points_m(image, scene, colours))
        except ValueError as fault:
            return None, 0, f"no cloud: {fault}"
    assert cloud is not None
    points = np.asarray(cloud.points_m)
    if points.ndim != 2 or points.shape[1] != 3:
        return None, 0, f"no cloud: points of shape {points.shape}, not (n, 3)"
    measured = np.ascontiguousarray(points, np.float64)
    possible, usable = usable_points(measured, workspace.low_m, workspace.high_m)
    dropped = len(points) - usable
    if usable < MIN_CLOUD_POINTS:
        reason = (
            f"no cloud: {usable} usable points on the tissue ({dropped} not finite), "
            f"at least {MIN_CLOUD_POINTS} are needed"
        )
        return None, dropped, reason
    share = len(possible) / usable
    if share < 1 / 2:
        reason = (
            f"no cloud: only {share:.0%} of its points lie where tissue can be; it should be in "
            "metres and in the tissue frame"
        )
        return None, dropped, reason
    return PointCloud(cloud.stamp_s, possible), dropped, ""


def _visibility(
    observation: Observation, scene: Scene, colours: ColourCalibration
) -> tuple[float | None, float | None, str]:
    """Share of the region that is seen, when, and why nobody knows ("" if known)."""
    value, stamp = observation.roi_visibility, observation.roi_visibility_stamp_s
    image = observation.endoscope_image
    if value is None and image is None:
        return None, None, "no visibility: the world gives neither it nor a picture"
    if value is None and image is not None:
        try:
            value, stamp = roi_visibility(image, scene, colours), image.stamp_s
        except ValueError as fault:
            return None, None, f"no visibility: {fault}"
    assert value is not None
    if not 0.0 <= value <= 1.0:
        return None, None, f"no visibility: {value} is not between 0 and 1"
    return value, stamp, ""
