"""Whether every reading is there, sound, and young enough to act on."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, isinf

from defras_bt.sensing.usable import all_finite
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmObservation, Observation

# Stamps and world time are sums of ticks: they may differ by rounding, not by more.
_ROUNDING_S = 1e-6


def ages_s(observation: Observation, scene: Scene) -> Mapping[str, float]:
    """Age of each reading, infinite where it is missing, unsound or stamped in the future.

    Readings are the scene's arms by name, ``cloud`` and ``roi_visibility``.
    """
    now = observation.time_s
    arms: dict[str, float] = {
        name: _arm_age_s(observation.arms.get(name), now) for name in scene.arms
    }
    cloud, visibility = observation.cloud, observation.roi_visibility
    sound_cloud = cloud is not None and len(cloud.points_m) > 0 and all_finite(cloud.points_m)
    sound_visibility = visibility is not None and isfinite(visibility)
    return {
        **arms,
        "cloud": age_s(cloud.stamp_s if cloud is not None and sound_cloud else None, now),
        "roi_visibility": age_s(
            observation.roi_visibility_stamp_s if sound_visibility else None, now
        ),
    }


def stale(observation: Observation, scene: Scene) -> Mapping[str, str]:
    """A sentence for each reading that must not be acted on; empty when all are fine."""
    limit = scene.thresholds.max_age_s
    return {
        name: (
            f"{name} is missing, not finite, or stamped in the future"
            if isinf(age)
            else f"{name} is {age:.2f} s old; at most {limit:g} s is allowed"
        )
        for name, age in ages_s(observation, scene).items()
        if not age <= limit
    }


def age_s(stamp_s: float | None, now_s: float) -> float:
    """Seconds since ``stamp_s``; infinite for None, NaN and the future: unknown is too old."""
    if stamp_s is None or not isfinite(stamp_s) or not isfinite(now_s):
        return float("inf")
    age = now_s - stamp_s
    return float("inf") if age < -_ROUNDING_S else max(age, 0.0)


def _arm_age_s(arm: ArmObservation | None, now_s: float) -> float:
    if arm is None:
        return float("inf")
    numbers = [arm.jaw_rad]
    for pose in (arm.tissue_from_tip, arm.setpoint_tissue_from_tip):
        numbers += [*pose.position_m.tolist(), *pose.rotation.ravel().tolist()]
    if arm.joints is not None:
        numbers += arm.joints.tolist()
    return age_s(arm.stamp_s if all(map(isfinite, numbers)) else None, now_s)
