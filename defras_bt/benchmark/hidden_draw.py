"""Draws of what a recording hides: an effect, its strength, the retraction and the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from defras_bt.benchmark.hidden_retraction import Script
from defras_sim.effects.effect import Extension, Values
from defras_sim.geometry import Floats
from defras_sim.retraction import arm_for
from defras_sim.scene import GraspPoint, Scene

NULL = "nothing"


@dataclass(frozen=True)
class Draw:
    """``hidden`` is what the scene does not know, nothing for :data:`NULL`. ``strength`` is the
    parameter by which the effect is strong."""

    effect: str
    hidden: Extension
    strength: str
    script: Script
    seed: int


@dataclass(frozen=True)
class _Around:
    """What a draw may look at: where tissue is lifted, where it is held, and when."""

    scene: Scene
    script: Script
    rng: np.random.Generator

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def either(self, low: float, high: float) -> float:
        """Between the two, of either sign."""
        return float(self.rng.choice([-1.0, 1.0])) * self.between(low, high)

    @property
    def grasp_m(self) -> Floats:
        return self.scene.grasp_xy_m(*self.script.point)

    def near_the_grasp(self) -> dict[str, float]:
        """A place under tissue that is lifted, inside the tissue."""
        half = np.array([self.scene.tissue.length_x_m, self.scene.tissue.width_y_m]) / 2 - 0.01
        angle = np.arctan2(*-self.grasp_m[::-1]) + self.between(-0.9, 0.9)
        away = self.between(0.022, 0.034)
        place = self.grasp_m + away * np.array([np.cos(angle), np.sin(angle)])
        x, y = np.clip(place, -half, half)
        return {"x_m": float(x), "y_m": float(y), "radius_m": self.between(0.011, 0.015)}

    def where_it_holds(self) -> dict[str, float]:
        """The attached place nearest to the grasp: there it is felt that it is missing."""
        held = self.scene.holes_xy_m[self.scene.attached]
        nearest = held[np.linalg.norm(held - self.grasp_m, axis=1).argmin()]
        x, y = nearest + self.rng.uniform(-0.004, 0.004, 2)
        return {"x_m": float(x), "y_m": float(y), "radius_m": self.between(0.018, 0.024)}

    def in_the_lift(self) -> float:
        """World time while the tissue is up: after the pull, before it is laid down."""
        s = self.script
        reach = s.rest_s + 3.0
        up = s.lift_m / s.speed_m_s
        return reach + up + self.between(0.3, 1.0)


_STRONG: Mapping[str, tuple[str, Callable[[_Around], Values]]] = {
    "anisotropy": ("strength", lambda a: {"strength": a.between(4, 8), "angle_rad": 0.6}),
    "attachment_compliance": (
        "compliance_m_per_n",
        lambda a: {"compliance_m_per_n": a.between(0.05, 0.15)},
    ),
    "attachment_tear": (
        "share",
        lambda a: {"share": 1.0, "time_s": a.in_the_lift(), **a.where_it_holds()},
    ),
    "bed_adhesion": ("strength_pa", lambda a: {"strength_pa": a.between(15, 30)}),
    "breathing": (
        "amplitude_m",
        lambda a: {"amplitude_m": a.between(0.0012, 0.002), "period_s": a.between(2.5, 4.0)},
    ),
    "camera_latency": ("delay_s", lambda a: {"delay_s": a.between(0.12, 0.25)}),
    "camera_registration": (
        "z_m",
        lambda a: {
            "x_m": a.either(0.001, 0.003),
            "z_m": a.either(0.0015, 0.003),
            "turn_y_rad": a.either(0.02, 0.04),
        },
    ),
    "depth_bias": ("scale", lambda a: {"scale": 1 + a.either(0.008, 0.015), "offset_m": 0.001}),
    "extra_attachment": (
        "share",
        lambda a: {"share": a.between(0.85, 0.98), **a.near_the_grasp()},
    ),
    "grasp_offset": (
        "x_m",
        lambda a: {"x_m": a.either(0.003, 0.005), "y_m": a.either(0.001, 0.003)},
    ),
    "grasp_slip": (
        "distance_m",
        lambda a: {"distance_m": a.between(0.005, 0.009), "time_s": a.in_the_lift()},
    ),
    "gravity": ("acceleration_m_s2", lambda a: {"acceleration_m_s2": a.between(0.5, 1.5)}),
    "inclusion": (
        "scale",
        lambda a: {"scale": a.between(4, 8), **a.near_the_grasp()},
    ),
    "joint_offset": ("q1_rad", lambda a: {"q1_rad": a.either(0.02, 0.03)}),
    "joint_play": ("q1_rad", lambda a: {"q1_rad": a.between(0.03, 0.05)}),
    "missing_attachment": ("share", lambda a: {"share": 1.0, **a.where_it_holds()}),
    "servo_lag": (
        "q3_s",
        lambda a: {"q1_s": a.between(0.05, 0.09), "q2_s": 0.06, "q3_s": a.between(0.05, 0.09)},
    ),
    "softening": ("share", lambda a: {"share": a.between(0.4, 0.6)}),
    "stiffness": ("scale", lambda a: {"scale": a.between(1.4, 1.8)}),
    "strain_stiffening": ("coefficient", lambda a: {"coefficient": a.between(2.0, 5.0)}),
    "stress_relaxation": (
        "fraction",
        lambda a: {"fraction": a.between(0.3, 0.5), "time_s": a.between(0.8, 2.0)},
    ),
    "thickness": ("scale", lambda a: {"scale": a.between(1.25, 1.4)}),
    "tool_offset": (
        "z_m",
        lambda a: {"x_m": a.either(0.003, 0.005), "y_m": a.either(0.002, 0.004)},
    ),
}
"""The parameter that tells the strength, and what is drawn: clearly seen, never grotesque."""

EFFECTS = tuple(_STRONG)


def draw(scene: Scene, effect: str, seed: int, point: GraspPoint = (2, 4)) -> Draw:
    """What ``seed`` hides of ``effect`` (:data:`NULL` for nothing) in a retraction at ``point``.

    Raises:
        ValueError: nobody has said how strong the effect should be.
    """
    rng = np.random.default_rng([seed, *effect.encode()])
    script = Script.drawn(scene, point, arm_for(scene, point), rng)
    if effect == NULL:
        return Draw(NULL, {}, "", script, seed)
    if effect not in _STRONG:
        raise ValueError(f"nothing can be drawn of {effect!r}; there are: {', '.join(EFFECTS)}")
    strength, values = _STRONG[effect]
    return Draw(effect, {effect: values(_Around(scene, script, rng))}, strength, script, seed)
