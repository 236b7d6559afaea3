"""Follows which arm holds tissue, from what the jaws say, and tells the twin."""

from __future__ import annotations

from typing import Protocol

from defras_bt.executive.blackboard import Blackboard, Grip
from defras_sim.geometry import Pose
from defras_sim.worlds.protocol import Observation


class HoldsTissue(Protocol):
    """The part of the twin that a grip concerns."""

    def grasp(self, arm: str, tissue_from_tip: Pose) -> None: ...

    def release(self, arm: str) -> None: ...


class GripTracker:
    """Keeps ``board.grips`` and the twin's grasps in step with the sensed jaws."""

    def __init__(self, board: Blackboard, twin: HoldsTissue) -> None:
        self._board = board
        self._twin = twin

    def update(self, observation: Observation) -> bool:
        """Take over what the jaws say; True if any grip began or ended.

        Raises:
            ValueError: a jaw holds something where the twin has no tissue.
        """
        changed = False
        for name, arm in observation.arms.items():
            holding = name in self._board.grips
            if arm.grasped and not holding:
                tip = arm.setpoint_tissue_from_tip
                self._twin.grasp(name, tip)
                self._board.grips[name] = Grip(self._board.at.get(name, (0, 0)), tip)
                changed = True
            elif not arm.grasped and holding:
                self._twin.release(name)
                del self._board.grips[name]
                # The tissue fell back, and the tip may be anywhere: a new grasp needs a new reach.
                self._board.at.pop(name, None)
                self._board.last_learning = None
                self._board.unexplained = False
                changed = True
        return changed
