"""Retractions in which attachments have to be learned, or must not be: drawn from seeds that no
training has seen, with the patients of the scene generator."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Literal

import numpy as np

from defras_bt.faults.clouds import Displaced
from defras_bt.faults.faults import Faults
from defras_sim.retraction import SEQUENCES, arm_for
from defras_sim.scene import ArmName, GraspPoint, ModelExtension, Scene
from defras_sim.scene_generator import draw_actual, draw_believed

Hidden = Literal["fewer", "more", "slip", "camera", "second_tool", "stiffness"]
HIDDEN: tuple[Hidden, ...] = ("fewer", "more", "slip", "camera", "second_tool", "stiffness")
OF_ATTACHMENTS: tuple[Hidden, ...] = ("fewer", "more")
_ANYWHERE: tuple[Hidden, ...] = ("slip", "camera", "second_tool")
OF_OTHER_CAUSES: dict[str, tuple[Hidden, ...]] = {
    "model": (*_ANYWHERE, "stiffness"),
    "bullet": _ANYWHERE,
}
"""By world: PyBullet's tissue is the same all over and has no stiff spots."""

FIRST_SEED = 100_000
"""Far from any seed of the training data."""

_FAR_M = 0.04


@dataclass(frozen=True)
class SecondTool:
    """An instrument that nobody told of: it takes the tissue at ``point`` and moves on with
    ``velocity_m_s`` (3,)."""

    arm: ArmName
    point: GraspPoint
    velocity_m_s: tuple[float, float, float]


@dataclass(frozen=True)
class UpdateCase:
    """What is believed, what is there, and the retraction in which it shows.

    The update is asked for in warning state ``state``.
    """

    hidden: Hidden
    seed: int
    believed: Scene
    actual: Scene
    arm: ArmName
    point: GraspPoint
    manoeuvres: tuple[str, ...]
    faults: Faults
    state: int
    second_tool: SecondTool | None = None

    @property
    def name(self) -> str:
        return f"{self.hidden} {self.seed}"


def wrongly_believed(seed: int, updates: int) -> list[tuple[Hidden, int]]:
    """So many seeds from ``seed`` on, with fewer and with more attachments in turn."""
    return [
        (OF_ATTACHMENTS[number % len(OF_ATTACHMENTS)], seed + number) for number in range(updates)
    ]


def otherwise_wrong(seed: int, each: int, world: str) -> list[tuple[Hidden, int]]:
    """So many seeds from ``seed`` on of each other mismatch that ``world`` can imitate."""
    return [(hidden, seed + number) for number in range(each) for hidden in OF_OTHER_CAUSES[world]]


def draw_update(hidden: Hidden, seed: int) -> UpdateCase:
    """The case of a seed. The tip starts right over its grasp point, which saves the way there."""
    digest = hashlib.sha256(f"attachments {hidden} {seed}".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "little"))
    believed = draw_believed(rng, name=f"update{seed}")
    point = _grasp_point(believed, rng)
    arm = arm_for(believed, point)
    manoeuvres = SEQUENCES[rng.integers(1, len(SEQUENCES))]
    second = _second_tool(believed, arm, point, rng) if hidden == "second_tool" else None
    believed = _over(believed, arm, point)
    actual, faults, state = believed, Faults((), seed), int(rng.integers(1, 3))
    if hidden == "fewer":
        actual = draw_actual(believed, "fewer", rng)
    elif hidden == "more":
        actual = draw_actual(believed, "more", rng)
    elif hidden == "slip":
        # Grasping takes about 2 s with the rest before it, a pull 3 s.
        slip = {
            "distance_m": float(rng.uniform(0.006, 0.015)),
            "time_s": float(rng.uniform(3.5, 6.5)),
        }
        actual = _with(believed, "grasp_slip", slip)
    elif hidden == "camera":
        way = rng.standard_normal(3)
        x, y, z = way * (rng.uniform(0.004, 0.008) / np.linalg.norm(way))
        offset_m = (float(x), float(y), float(z))
        faults = Faults((Displaced(start_s=float(rng.uniform(3.5, 6.5)), offset_m=offset_m),), seed)
    elif hidden == "stiffness":
        half_m = np.array([believed.tissue.length_x_m, believed.tissue.width_y_m]) / 4
        x, y = rng.uniform(-half_m, half_m)
        disc = {"scale": float(rng.uniform(5.0, 30.0)), "x_m": float(x), "y_m": float(y)}
        actual = _with(believed, "inclusion", {**disc, "radius_m": float(rng.uniform(0.015, 0.03))})
    if second is not None:
        actual = _over(actual, second.arm, second.point)
        believed = believed.model_copy(update={"arms": {arm: believed.arms[arm]}})
    return UpdateCase(hidden, seed, believed, actual, arm, point, manoeuvres, faults, state, second)


def _grasp_point(believed: Scene, rng: np.random.Generator) -> GraspPoint:
    """Away from what is believed to hold, as planning prefers."""
    held_m = believed.holes_m[believed.attached]
    points = believed.grasp_points
    away_m = [np.linalg.norm(held_m - believed.grasp_point_m(*p), axis=1).min() for p in points]
    weight = np.maximum(np.array(away_m) - 0.015, 0.0) ** 2
    if not weight.any():
        return points[int(np.argmax(away_m))]
    return points[int(rng.choice(len(points), p=weight / weight.sum()))]


def _second_tool(
    scene: Scene, arm: ArmName, point: GraspPoint, rng: np.random.Generator
) -> SecondTool | None:
    other: ArmName = "psm2" if arm == "psm1" else "psm1"
    far = [
        place
        for place in scene.grasp_points
        if other in scene.arms_at(*place)
        and np.linalg.norm(scene.grasp_point_m(*place) - scene.grasp_point_m(*point)) > _FAR_M
    ]
    if not far:
        return None
    x, y = rng.normal(0.0, 0.003, 2)
    velocity_m_s = (float(x), float(y), float(rng.uniform(0.002, 0.005)))
    return SecondTool(other, far[int(rng.integers(len(far)))], velocity_m_s)


def _over(scene: Scene, arm: ArmName, point: GraspPoint) -> Scene:
    """With the tip of ``arm`` on ``point`` from the start."""
    x, y, z = scene.grasp_point_m(*point)
    home = scene.arms[arm].model_copy(update={"home_tip_m": (float(x), float(y), float(z))})
    return scene.model_copy(update={"arms": {**scene.arms, arm: home}})


def _with(scene: Scene, effect: str, values: dict[str, float]) -> Scene:
    return scene.model_copy(update={"model": ModelExtension.of({effect: values})})
