"""What is otherwise than believed, attachments apart: in the tissue, the arms, or the camera.

The label of such a sample is the belief itself: whoever changes attachments for it is wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import GraspPoint, Scene

Cause = Literal["attachments", "nothing", "slip", "camera", "arm", "second_tool", "stiffness"]
CAUSES: tuple[Cause, ...] = (
    "attachments",
    "nothing",
    "slip",
    "camera",
    "arm",
    "second_tool",
    "stiffness",
)
SHARES = (0.72, 0.06, 0.06, 0.05, 0.04, 0.04, 0.03)
"""How often each is drawn."""


@dataclass(frozen=True)
class Circumstances:
    """How reality departs from the model beside the attachments.

    ``inclusion`` are the parameters of that effect on the actual tissue, if it has one. Every tip
    is ``arm_m`` (3,) off; from keyframe ``slip_from`` on what a jaw holds stays behind by
    ``slid_m`` (3,). From keyframe ``camera_from`` on the camera reports places moved by
    ``reported``. ``second_grasp`` is a place that an unknown instrument takes at the grasp, and
    moves on by ``second_step_m`` (3,) a keyframe.
    """

    arm_m: Floats
    reported: Pose
    camera_from: int = 0
    slip_from: int = 0
    slid_m: Floats = field(default_factory=lambda: np.zeros(3))
    inclusion: Mapping[str, float] | None = None
    second_grasp: GraspPoint | None = None
    second_step_m: Floats = field(default_factory=lambda: np.zeros(3))

    def tip(self, commanded: Pose, frame: int) -> Pose:
        """Where the patch really is that an arm holds when told to be at ``commanded``."""
        slid_m = self.slid_m if frame >= self.slip_from else np.zeros(3)
        return commanded.moved(self.arm_m + slid_m)


def draw_circumstances(
    cause: Cause, patient: Scene, point: GraspPoint, frames: int, rng: np.random.Generator
) -> Circumstances:
    """Of a retraction of ``frames`` keyframes that grasps at ``point``.

    Every camera and every arm is registered with a small error, whatever the cause.
    """
    arm_m = 0.0004 * rng.standard_normal(3)
    registration = Pose(
        0.0003 * rng.standard_normal(3),
        Rotation.from_rotvec(0.002 * rng.standard_normal(3)).as_matrix(),
    )
    start = int(rng.integers(2, max(3, frames - 2)))
    plain = Circumstances(arm_m, registration)
    if cause == "slip":
        slid_m = _within(rng, 0.004, 0.015)
        slid_m[2] = -abs(slid_m[2])
        return replace(plain, slip_from=start, slid_m=slid_m)
    if cause == "camera":
        turn = Rotation.from_rotvec(_within(rng, 0.0, 0.05)).as_matrix()
        knocked = Pose(_within(rng, 0.003, 0.009), turn)
        begun = int(rng.choice([0, start]))
        return replace(plain, reported=knocked @ registration, camera_from=begun)
    if cause == "arm":
        angle = rng.uniform(0, 2 * np.pi)
        off_m = rng.uniform(0.004, 0.009) * np.array([np.cos(angle), np.sin(angle), 0.0])
        return replace(plain, arm_m=off_m)
    if cause == "stiffness":
        return replace(plain, inclusion=_inclusion(patient, rng))
    far = _far_points(patient, point)
    if cause == "second_tool" and far:
        step_m = _within(rng, 0.001, 0.003)
        step_m[2] = abs(step_m[2])
        place = far[rng.integers(len(far))]
        return replace(plain, second_grasp=place, second_step_m=step_m)
    return plain


def _inclusion(patient: Scene, rng: np.random.Generator) -> dict[str, float]:
    """A disc that is 3 to 30 times as stiff as the rest."""
    half_m = np.array([patient.tissue.length_x_m, patient.tissue.width_y_m]) / 3
    x_m, y_m = rng.uniform(-half_m, half_m)
    return {
        "scale": float(np.exp(rng.uniform(np.log(3.0), np.log(30.0)))),
        "x_m": float(x_m),
        "y_m": float(y_m),
        "radius_m": float(rng.uniform(0.01, 0.025)),
    }


def _far_points(patient: Scene, point: GraspPoint) -> list[GraspPoint]:
    """Grasp points more than 40 mm from ``point``."""
    here_m = patient.grasp_point_m(*point)
    return [
        place
        for place in patient.grasp_points
        if np.linalg.norm(patient.grasp_point_m(*place) - here_m) > 0.04
    ]


def _within(rng: np.random.Generator, least: float, most: float) -> Floats:
    """A vector (3,) of random direction and of a length between both."""
    way: Floats = rng.standard_normal(3)
    return way * (rng.uniform(least, most) / np.linalg.norm(way))
