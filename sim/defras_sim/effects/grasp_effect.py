"""GraspEffect: the tissue is not held as the tip says."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from defras_sim.effects.effect import Effect, Layer, TwinName, Values
from defras_sim.geometry import Floats, Pose


class GraspEffect(Effect):
    """Changes which patch a jaw takes, or where the held patch goes afterwards.

    Effects on the hold act on whole histories, so memory needs no state. The last row is the
    present; an effect is causal, so histories can grow row by row.
    """

    layer: ClassVar[Layer] = "grasp"
    twins: ClassVar[tuple[TwinName, ...]] = ("tissue",)

    def point(self, values: Values, tissue_from_tip: Pose) -> Pose:
        """tissue_from_jaw: where the jaw really closes when its tip seems to be at the pose."""
        return tissue_from_tip

    def slipped_m(self, values: Values, time_s: Floats, tip_m: Floats) -> Floats:
        """How far (n, 3) the held patch is, in the tissue frame, from where a firm grip would have
        carried it, for the tip at ``tip_m`` (n, 3) at world time ``time_s`` (n,); the first row is
        the moment of the grasp."""
        return np.zeros_like(tip_m)
