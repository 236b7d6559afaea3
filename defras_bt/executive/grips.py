"""Follows which arm holds tissue, from what the jaws say, and tells the twin."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Protocol

import numpy as np

from defras_bt.executive.blackboard import Blackboard, Grip
from defras_bt.planning.plan import GridPoint
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.tissue.grasp import NothingToGrasp
from defras_sim.worlds.protocol import Observation


class HoldsTissue(Protocol):
    """The part of the twin that a grip concerns."""

    @property
    def scene(self) -> Scene: ...

    def grasp(self, arm: str, tissue_from_tip: Pose, time_s: float) -> None: ...

    def release(self, arm: str, time_s: float) -> None: ...


class GripTracker:
    """Keeps ``board.grips`` and the twin's grasps in step with the sensed jaws."""

    def __init__(self, board: Blackboard, twin: HoldsTissue) -> None:
        self._board = board
        self._twin = twin
        self.contradictions: Mapping[str, str] = {}
        """A sentence for each jaw that says, as of the latest update, what cannot be."""

    def update(self, observation: Observation, unsound: Collection[str] = ()) -> bool:
        """Take over what the jaws say; True if any grip began or ended.

        An arm whose reading is ``unsound``, or whose jaw does not tell, holds what it held. A jaw
        that says it took tissue where the twin has none is not believed: see ``contradictions``.
        """
        changed, contradictions = False, {}
        for name, arm in observation.arms.items():
            if name in unsound or arm.grasped is None:
                continue
            holding = name in self._board.grips
            if arm.grasped and not holding:
                tip = arm.setpoint_tissue_from_tip
                try:
                    self._twin.grasp(name, tip, observation.time_s)
                except NothingToGrasp as miss:
                    contradictions[name] = f"{name} says that it holds tissue, but {miss}"
                    continue
                self._board.grips[name] = Grip(self._point_of(name, tip), tip)
                changed = True
            elif not arm.grasped and holding:
                self._twin.release(name, observation.time_s)
                del self._board.grips[name]
                # The tissue fell back, and the tip may be anywhere: a new grasp needs a new reach.
                self._board.at.pop(name, None)
                self._board.last_learning = None
                self._board.unexplained = False
                self._board.posterior = None
                self._board.mismatch = None
                changed = True
        self.contradictions = contradictions
        return changed

    def _point_of(self, arm: str, tip: Pose) -> GridPoint:
        """The grasp point reached last, else the nearest: a jaw may still close on its way off."""
        if arm in self._board.at:
            return self._board.at[arm]
        scene = self._twin.scene
        return min(
            scene.grasp_points,
            key=lambda point: float(np.linalg.norm(scene.grasp_xy_m(*point) - tip.position_m[:2])),
        )
