"""grasp_slip: the tissue slides through the jaw, and stays held farther back."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.grasp_effect import GraspEffect
from defras_sim.geometry import Floats

SLIDING_S = 0.2
"""The tissue slides for so long; friction then holds again."""


class GraspSlip(GraspEffect):
    """The held patch slides back towards where it was taken: tension pulls it there.

    A slide longer than the way of the tip since the grasp ends where the tissue was taken.
    """

    name = "grasp_slip"
    sentence = "The tissue slipped in the jaw and follows it from farther back."
    parameters = (
        EffectParameter("distance_m", "m", 0.0, 0.0, 0.05, 0.004, "how far the tissue slid"),
        EffectParameter(
            "time_s", "s", 0.0, 0.0, 1e6, 0.5, "world time of the slip", strength=False
        ),
    )
    falsified_by = "The tissue around the jaw keeps its place against the tip, and force its level."
    excited_by = "A pull up and a hold with tension, then the same way back."
    source = "Stoll and Dupont 2006, Force control for grasping soft tissue (ICRA)"

    def slipped_m(self, values: Values, time_s: Floats, tip_m: Floats) -> Floats:
        own = self.complete(values)
        start_s = own["time_s"]
        if start_s < time_s[0]:  # before the grasp: there was nothing to slip
            return np.zeros_like(tip_m)
        way_m = np.array([np.interp(start_s, time_s, tip_m[:, i]) for i in range(3)]) - tip_m[0]
        length_m = float(np.linalg.norm(way_m))
        if length_m == 0.0:
            return np.zeros_like(tip_m)
        share = np.clip((time_s - start_s) / SLIDING_S, 0.0, 1.0)
        back_m = min(own["distance_m"], length_m) / length_m * way_m
        return -share[:, None] * back_m


EFFECT = GraspSlip()
