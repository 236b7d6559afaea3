"""What happened when: phases of a retraction, from what the arms were told."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats
from defras_sim.motion import away_from_endoscope
from defras_sim.recorded_motion import RecordedMotion
from defras_sim.scene import Scene

PHASES = ("rest", "pull", "lower", "move", "fold", "hold", "after release")

SLOW_M_S = 0.0015
"""A tip slower than this stands still."""
_ALONG = 0.6
"""Cosine from which on a motion goes along a direction."""


def phases(motion: RecordedMotion, scene: Scene) -> Integers:
    """Index into :data:`PHASES` (n,) for every instant of ``motion``.

    "rest" is before any arm has taken tissue, "after release" while none holds it any more. Of
    several arms that hold, the fastest says what is done.
    """
    count = len(motion)
    held = np.stack([arm.grasped for arm in motion.arms.values()])
    velocity = np.stack(
        [
            np.where(arm.grasped[:, None], _velocity_m_s(arm.position_m, motion.time_s), 0.0)
            for arm in motion.arms.values()
        ]
    )
    fastest = velocity[np.linalg.norm(velocity, axis=2).argmax(axis=0), np.arange(count)]
    speed = np.linalg.norm(fastest, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = fastest / speed[:, None]
    names = np.full(count, "move", dtype=object)
    names[along @ away_from_endoscope(scene) > _ALONG] = "fold"
    names[along[:, 2] > _ALONG] = "pull"
    names[along[:, 2] < -_ALONG] = "lower"
    names[speed < SLOW_M_S] = "hold"
    any_held = held.any(axis=0)
    names[~any_held] = "after release"
    names[~np.logical_or.accumulate(any_held)] = "rest"
    return np.array([PHASES.index(name) for name in names], dtype=np.int64)


def _velocity_m_s(position_m: Floats, time_s: Floats) -> Floats:
    """Velocity (n, 3) over the step to the instant before and the one after."""
    if len(time_s) < 2:
        return np.zeros_like(position_m)
    return np.asarray(np.gradient(position_m, time_s, axis=0))
