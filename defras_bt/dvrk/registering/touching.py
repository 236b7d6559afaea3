"""Where an arm's tip is while it touches a landmark."""

from __future__ import annotations

from collections.abc import Callable
from time import sleep

import numpy as np

from defras_bt.dvrk.crtk.arm import CrtkArm
from defras_sim.geometry import Floats, Pose

SAMPLES = 25
_EVERY_S = 0.02
_STILL_M = 0.0005


class NotStill(RuntimeError):
    """The arm moved while it should have touched; the message says by how much."""


def touched_m(arm: CrtkArm, pause: Callable[[float], None] = sleep) -> Floats:
    """The tip's mean position (3,) in the arm's frame, over half a second.

    Raises:
        NotStill: the arm moves.
        NotFresh: it does not say where it is.
    """
    reported_from_tip = Pose(np.array([0.0, 0.0, arm.setup.reported_to_tip_m]))
    seen = []
    for _ in range(SAMPLES):
        seen.append((arm.pose().value @ reported_from_tip).position_m)
        pause(_EVERY_S)
    tips_m = np.array(seen)
    middle_m: Floats = tips_m.mean(axis=0)
    away_m = float(np.linalg.norm(tips_m - middle_m, axis=1).max())
    if away_m > _STILL_M:
        raise NotStill(
            f"{arm.name} moved by {away_m * 1e3:.1f} mm meanwhile; hold it still, at most "
            f"{_STILL_M * 1e3:g} mm are allowed"
        )
    return middle_m
