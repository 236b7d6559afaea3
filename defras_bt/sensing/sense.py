"""From what a world delivers to what the executive works with."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from defras_bt.sensing.cloud import Workspace, tissue_points_m
from defras_bt.sensing.colours import DEFAULT_COLOURS, ColourCalibration
from defras_bt.sensing.roi import roi_visibility
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
    observation: Observation, scene: Scene, colours: ColourCalibration = DEFAULT_COLOURS
) -> SensedObservation:
    """Fill in cloud and region visibility; what a world delivers ready-made passes through.

    Bad data never raises: it ends up as None with a sentence in ``faults``, and whoever needs the
    reading has to treat None as a tripped guard. What was sensed already, as in a recording, stays.
    """
    if isinstance(observation, SensedObservation):
        return observation
    taken = {entry.name: getattr(observation, entry.name) for entry in fields(Observation)}
    sensed = _with_visibility(SensedObservation(**taken), scene, colours)
    return _with_cloud(sensed, scene, colours)


def _with_cloud(
    sensed: SensedObservation, scene: Scene, colours: ColourCalibration
) -> SensedObservation:
    cloud, image = sensed.cloud, sensed.depth_image
    if cloud is None and image is None:
        return _faulty(sensed, "no cloud: the world gives neither a cloud nor a depth picture")
    if cloud is None and image is not None:
        try:
            cloud = PointCloud(image.stamp_s, tissue_points_m(image, scene, colours))
        except ValueError as fault:
            return _faulty(sensed, f"no cloud: {fault}")
    assert cloud is not None
    # Depth cameras measure, and recordings keep, no more than single precision.
    with np.errstate(over="ignore"):  # what is too large for that is dropped as infinite
        points = np.asarray(cloud.points_m, np.float32).astype(np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        shape = points.shape
        return _faulty(
            replace(sensed, cloud=None), f"no cloud: points of shape {shape}, not (n, 3)"
        )
    finite = np.isfinite(points).all(axis=1)
    dropped = int(len(points) - finite.sum())
    if finite.sum() < MIN_CLOUD_POINTS:
        reason = (
            f"no cloud: {int(finite.sum())} usable points on the tissue ({dropped} not finite), "
            f"at least {MIN_CLOUD_POINTS} are needed"
        )
        return _faulty(replace(sensed, cloud=None, dropped_points=dropped), reason)
    possible = finite & Workspace.of(scene).holds(points)
    if possible.sum() < finite.sum() / 2:
        share = possible.sum() / finite.sum()
        reason = (
            f"no cloud: only {share:.0%} of its points lie where tissue can be; it should be in "
            "metres and in the tissue frame"
        )
        return _faulty(replace(sensed, cloud=None, dropped_points=dropped), reason)
    sound = PointCloud(cloud.stamp_s, points[possible])
    return replace(sensed, cloud=sound, dropped_points=dropped)


def _with_visibility(
    sensed: SensedObservation, scene: Scene, colours: ColourCalibration
) -> SensedObservation:
    value, stamp = sensed.roi_visibility, sensed.roi_visibility_stamp_s
    image = sensed.endoscope_image
    unseen = replace(sensed, roi_visibility=None, roi_visibility_stamp_s=None)
    if value is None and image is None:
        return _faulty(unseen, "no visibility: the world gives neither it nor a picture")
    if value is None and image is not None:
        try:
            value, stamp = roi_visibility(image, scene, colours), image.stamp_s
        except ValueError as fault:
            return _faulty(unseen, f"no visibility: {fault}")
    assert value is not None
    if not 0.0 <= value <= 1.0:
        return _faulty(unseen, f"no visibility: {value} is not between 0 and 1")
    return replace(sensed, roi_visibility=value, roi_visibility_stamp_s=stamp)


def _faulty(sensed: SensedObservation, sentence: str) -> SensedObservation:
    return replace(sensed, faults=(*sensed.faults, sentence))
