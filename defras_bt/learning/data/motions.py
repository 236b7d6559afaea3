"""Random tool paths: where tissue is taken, and where it is led."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.motion import away_from_endoscope
from defras_sim.retraction import arm_for
from defras_sim.scene import ArmName, GraspPoint, Scene
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

STEP_M = 0.004
"""Between two keyframes: as far as the tissue model goes in one step."""

_MOST_FRAMES = 15
KEYFRAME_S = 1.0
"""World time between two keyframes: nothing in the plain model depends on it."""


@dataclass(frozen=True)
class Hold:
    """One arm on its way: ``way_m`` (frames, 3) starts where the jaw closes."""

    arm: ArmName
    point: GraspPoint
    way_m: Floats

    def tip(self, frame: int) -> Pose:
        """tissue_from_tip at a keyframe."""
        return Pose(self.way_m[frame], POINTING_DOWN)


def draw_hold(patient: Scene, rng: np.random.Generator) -> Hold:
    """A grasp, a pull and one or two motions more: to the region, folding, or anywhere.

    Points away from what holds the tissue are preferred, as planning prefers them.
    """
    points = patient.grasp_points
    held_m = patient.holes_m[patient.attached]
    away = np.array(
        [np.linalg.norm(held_m - patient.grasp_point_m(*p), axis=1).min() for p in points]
    )
    usable = np.array([bool(patient.arms_at(*p)) for p in points])
    weight = usable * np.minimum(away, 0.06) ** 2
    point = points[rng.choice(len(points), p=weight / weight.sum())]
    place_m = patient.grasp_point_m(*point)
    lifted_m = np.array([*rng.normal(0.0, 0.006, 2), rng.uniform(0.015, 0.045)])
    corners = [place_m, place_m + lifted_m]
    for _ in range(int(rng.integers(0, 3))):
        corners.append(corners[-1] + _manoeuvre_m(patient, corners[-1], rng))
    return Hold(arm_for(patient, point), point, _stepped(corners)[:_MOST_FRAMES])


def _manoeuvre_m(patient: Scene, tip_m: Floats, rng: np.random.Generator) -> Floats:
    """A way (3,) of the tip: folding back, towards the region, or in any direction."""
    kind = rng.choice(3, p=(0.45, 0.25, 0.3))
    if kind == 0:
        way = away_from_endoscope(patient) + np.array([*rng.normal(0.0, 0.2, 2), 0.0])
        return way * rng.uniform(0.02, 0.05)
    if kind == 1:
        towards = np.array([*(patient.roi_center_m[:2] - tip_m[:2]), 0.0])
        return towards * min(1.0, 0.03 / max(float(np.linalg.norm(towards)), 1e-9))
    turn = rng.uniform(0, 2 * np.pi)
    return rng.uniform(0.01, 0.035) * np.array([np.cos(turn), np.sin(turn), rng.uniform(-0.3, 0.4)])


def _stepped(corners: list[Floats]) -> Floats:
    places = [corners[0]]
    for start, end in pairwise(corners):
        count = max(1, round(float(np.linalg.norm(end - start)) / STEP_M))
        places += [start + (end - start) * (i / count) for i in range(1, count + 1)]
    return np.array(places)
