"""Pull, move, fold: the leaves that move held tissue."""

from __future__ import annotations

from py_trees.common import Status

from defras_bt.acting.arm_action import ArmAction
from defras_bt.executive.reasons import Code
from defras_bt.executive.registry import register_node
from defras_sim.geometry import Floats
from defras_sim.motion import manoeuvre_target_m

# After a manoeuvre the cameras need a moment to show where the tissue came to rest.
SETTLE_S = 0.3


class Manoeuvre(ArmAction):
    """Base of the leaves that move held tissue; one that was interrupted goes on to its old end."""

    def initialise(self) -> None:
        super().initialise()
        self._arrived_s: float | None = None
        self._way_m: tuple[Floats, Floats] | None = None

    def update(self) -> Status:
        board = self.context.board
        grip = board.grips.get(self.arm)
        if grip is None or grip.point != self.point:
            return self.fail(
                Code.NOT_HOLDING, f"{self.who} does not hold the tissue at {self.point}"
            )
        start_m = grip.starts_m.setdefault(self.spoken, self.setpoint_m.copy())
        if self._way_m is None or self._way_m[0] is not start_m:
            self._way_m = (start_m, manoeuvre_target_m(self.context.scene, self.spoken, start_m))
        if not self.go(self._way_m[1], self.context.scene.motion.tissue_speed_m_s):
            self._arrived_s = None
            return self.run(Code.MOVING, f"{self.who}: {self.spoken}, tissue held at {self.point}")
        now_s = board.inputs.time_s
        if self._arrived_s is None:
            self._arrived_s = now_s
        if now_s - self._arrived_s < SETTLE_S:
            return self.run(Code.SETTLING, f"{self.who} waits for the tissue to settle")
        grip.done = (*grip.done, self.spoken)
        return self.finish(f"{self.who} has finished: {self.spoken}.")


@register_node
class Pull(Manoeuvre):
    """Lift the held tissue straight up."""

    spoken = "pull"


@register_node
class Move(Manoeuvre):
    """Move the held tissue planarly towards the region of interest."""

    spoken = "move"


@register_node
class Fold(Manoeuvre):
    """Move the held tissue away from the endoscope, so that it folds back."""

    spoken = "fold"
