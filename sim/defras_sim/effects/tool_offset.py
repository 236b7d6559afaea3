"""tool_offset: arm and tissue are registered to each other wrongly."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.effects.effect import ArmEffect, EffectParameter, Values
from defras_sim.geometry import Floats

_AXES = "xyz"


class ToolOffset(ArmEffect):
    """A rigid error between what the arms take for the tissue's frame and that frame, the same
    everywhere. Encoders know nothing of it."""

    name = "tool_offset"
    twins = ("tissue",)
    sentence = "The arms are not registered to the tissue: tips are displaced by a rigid error."
    parameters = (
        *(
            EffectParameter(f"{a}_m", "m", 0.0, -0.03, 0.03, 0.002, f"shift of the tip along {a}")
            for a in _AXES
        ),
        *(
            EffectParameter(
                f"turn_{a}_rad", "rad", 0.0, -0.3, 0.3, 0.02, f"turn about {a} of the tissue frame"
            )
            for a in _AXES
        ),
    )
    falsified_by = "Grasps at distant points are displaced differently than one rigid motion can."
    excited_by = "Grasps far apart, and long pulls in two directions."
    source = (
        "Hwang et al. 2020, Efficiently calibrating cable-driven surgical robots with RGBD "
        "fiducial sensing and recurrent neural networks (RA-L)"
    )

    def tip_error(
        self, values: Values, tip_m: Floats, force_n: Floats, rcm_m: Floats
    ) -> tuple[Floats, Floats]:
        own = self.complete(values)
        shift_m = np.array([own[f"{a}_m"] for a in _AXES])
        turn = np.array([own[f"turn_{a}_rad"] for a in _AXES])
        turned_m = Rotation.from_rotvec(turn).apply(tip_m) - tip_m
        return turned_m + shift_m, np.tile(turn, (len(tip_m), 1))


EFFECT = ToolOffset()
