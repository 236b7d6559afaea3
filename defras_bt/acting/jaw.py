"""Open, grasp, release: the leaves that move only the jaw."""

from __future__ import annotations

from py_trees.common import Status

from defras_bt.acting.arm_action import ArmAction
from defras_bt.executive.reasons import Code
from defras_bt.executive.registry import register_node
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, JAW_OPEN_RAD, ArmCommand

JAW_TOLERANCE_RAD = 0.05
JAW_TIME_OUT_S = 3.0


class JawAction(ArmAction):
    """Base of the leaves that drive the jaw to an angle while the tip stays."""

    def drive(self, jaw_rad: float) -> None:
        self.context.board.move(self.arm, ArmCommand(jaw_rad=jaw_rad))

    def timed_out(self, wanted: str) -> Status | None:
        if self.elapsed_s <= JAW_TIME_OUT_S:
            return None
        jaw_rad = self.observed.jaw_rad
        return self.fail(
            Code.JAW_STUCK,
            f"{self.who}'s jaw should be {wanted} after {JAW_TIME_OUT_S:g} s "
            f"but stands at {jaw_rad:.2f} rad",
        )

    @property
    def is_open(self) -> bool:
        return self.observed.jaw_rad >= JAW_OPEN_RAD - JAW_TOLERANCE_RAD


@register_node
class Open(JawAction):
    """Open the jaw before a grasp."""

    spoken = "open"

    def update(self) -> Status:
        if self.arm in self.context.board.grips:
            return self.fail(Code.HOLDING, f"{self.who} holds tissue: opening would drop it")
        self.drive(JAW_OPEN_RAD)
        if self.is_open:
            return self.finish(f"{self.who} has opened its jaw.")
        return self.timed_out("open") or self.run(Code.OPENING, f"{self.who} opens its jaw")


@register_node
class Grasp(JawAction):
    """Close the jaw on the tissue; a grasp that fails blocks its point."""

    spoken = "grasp"

    def update(self) -> Status:
        board = self.context.board
        if board.at.get(self.arm) != self.point:
            return self.fail(Code.NOT_THERE, f"{self.who} is not at grasp point {self.point}")
        self.drive(JAW_CLOSED_RAD)
        if self.arm in board.grips:
            return self.finish(f"{self.who} has grasped the tissue at {self.point}.")
        closed = self.observed.jaw_rad <= JAW_CLOSED_RAD + JAW_TOLERANCE_RAD
        if closed or self.elapsed_s > JAW_TIME_OUT_S:
            board.blocked.add(self.point)
            why = f"{self.who} closed its jaw at {self.point} without getting hold of the tissue"
            return self.fail(Code.NOTHING_GRASPED, why)
        return self.run(Code.CLOSING, f"{self.who} closes its jaw")


@register_node
class Release(JawAction):
    """Open the jaw so that the tissue goes free."""

    spoken = "release"

    def update(self) -> Status:
        self.drive(JAW_OPEN_RAD)
        if self.is_open and self.arm not in self.context.board.grips:
            return self.finish(f"{self.who} has released the tissue.")
        return self.timed_out("open") or self.run(Code.OPENING, f"{self.who} releases the tissue")
