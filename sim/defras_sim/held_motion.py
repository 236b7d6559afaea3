"""HeldMotion: from what arms are told to where the patches go that their jaws hold."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy

import numpy as np

from defras_sim.effects.arm_layer import ArmLayer
from defras_sim.effects.grasp_layer import GraspLayer
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene

NO_PULL: Floats = np.zeros(3)


class HeldMotion:
    """The arm and the grasp layer of every arm of a scene, along one motion.

    Example:
        >>> motion = HeldMotion(scene, layers)
        >>> motion.follow(setpoints, time_s)
        >>> model.grasp("psm1", motion.take("psm1", time_s))
        >>> model.solve(motion.held(time_s, forces_n))
    """

    def __init__(self, scene: Scene, layers: Layers) -> None:
        self._layers = layers
        self._arms: dict[str, ArmLayer] = {
            name: ArmLayer(np.array(arm.rcm_m), layers.arm) for name, arm in scene.arms.items()
        }
        self._grips: dict[str, GraspLayer] = {}

    def copy(self) -> HeldMotion:
        """The same motion so far, to be continued otherwise."""
        return deepcopy(self)

    @property
    def gives(self) -> bool:
        """Whether arms may give way to the tissue's pull."""
        return bool(self._layers.arm)

    def follow(self, setpoints: Mapping[str, Pose], time_s: float) -> None:
        """The arms are told to be at ``setpoints`` (tissue_from_tip) at world time ``time_s``."""
        for arm, pose in setpoints.items():
            self._arms[arm].follow(time_s, pose)

    def tip(self, arm: str, pull_n: Floats = NO_PULL) -> Pose:
        """tissue_from_tip: where an arm's tip really is while the tissue pulls with (3,) [N]."""
        return self._arms[arm].tip(pull_n)

    def measured(self, arm: str) -> Pose:
        """tissue_from_tip: where an arm's encoders say that its tip is."""
        return self._arms[arm].measured()

    def jaw(self, arm: str, time_s: float) -> Pose:
        """tissue_from_jaw: where ``arm`` would take the tissue if its jaw closed now."""
        return GraspLayer(self._layers.grasp, time_s, self.tip(arm)).taken

    def take(self, arm: str, time_s: float) -> Pose:
        """``arm`` closes its jaw; where (tissue_from_jaw) it really takes the tissue."""
        self._grips[arm] = GraspLayer(self._layers.grasp, time_s, self.tip(arm))
        return self._grips[arm].taken

    def let_go(self, arm: str) -> None:
        del self._grips[arm]

    def held(self, time_s: float, forces_n: Mapping[str, Floats]) -> dict[str, Pose]:
        """Where each held patch (tissue_from_jaw) is carried, in the order in which they were
        taken, with the jaws exerting ``forces_n`` (3,) on the tissue."""
        return {
            arm: grip.held(time_s, self.tip(arm, -forces_n.get(arm, NO_PULL)))
            for arm, grip in self._grips.items()
        }
