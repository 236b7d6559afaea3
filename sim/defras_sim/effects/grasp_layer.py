"""GraspLayer: which patch one arm's jaw holds, and where the patch goes with the tip."""

from __future__ import annotations

from collections.abc import Sequence

from defras_sim.effects.effect import Values
from defras_sim.effects.grasp_effect import GraspEffect
from defras_sim.effects.history import History
from defras_sim.geometry import Pose


class GraspLayer:
    """One grip, from the moment when the jaw took the tissue."""

    def __init__(
        self,
        effects: Sequence[tuple[GraspEffect, Values]],
        time_s: float,
        tissue_from_tip: Pose,
    ) -> None:
        """The jaw closes at ``time_s`` with its tip really at the pose."""
        self._effects = tuple(effects)
        self._tips = History(3)
        self._tips.add(time_s, tissue_from_tip.position_m)
        jaw = tissue_from_tip
        for effect, values in self._effects:
            jaw = effect.point(values, jaw)
        self.taken = jaw
        """tissue_from_jaw at which the tissue was taken."""
        self._tip_from_jaw = tissue_from_tip.inverse() @ jaw

    def held(self, time_s: float, tissue_from_tip: Pose) -> Pose:
        """tissue_from_jaw: where the held patch is carried by the tip, really at the pose."""
        if not self._effects:
            return tissue_from_tip
        self._tips.add(time_s, tissue_from_tip.position_m)
        jaw = tissue_from_tip @ self._tip_from_jaw
        for effect, values in self._effects:
            slipped_m = effect.slipped_m(values, self._tips.time_s, self._tips.values)
            jaw = jaw.moved(slipped_m[-1])
        return jaw
