"""grasp_offset: the jaw took the tissue beside the point it was sent to."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.grasp_effect import GraspEffect
from defras_sim.geometry import Pose


class GraspOffset(GraspEffect):
    name = "grasp_offset"
    sentence = "The jaw took the tissue beside the point it was sent to."
    parameters = (
        EffectParameter("x_m", "m", 0.0, -0.03, 0.03, 0.002, "along x of the tissue frame"),
        EffectParameter("y_m", "m", 0.0, -0.03, 0.03, 0.002, "along y of the tissue frame"),
    )
    falsified_by = "The peak of the lifted tissue lies where the tip is."
    excited_by = "A straight pull upwards and a hold: the peak shows where the tissue is held."
    source = (
        "Uncalibrated dVRK tips are millimetres off: Hwang et al. 2020, Efficiently calibrating "
        "cable-driven surgical robots with RGBD fiducial sensing and recurrent neural networks"
    )

    def point(self, values: Values, tissue_from_tip: Pose) -> Pose:
        own = self.complete(values)
        return tissue_from_tip.moved(np.array([own["x_m"], own["y_m"], 0.0]))


EFFECT = GraspOffset()
