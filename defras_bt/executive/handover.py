"""What the executive does when the operator pauses, takes over, or lets the operation go on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from defras_bt.executive.blackboard import Blackboard
from defras_bt.executive.composites import PlanSlot
from defras_bt.planning.plan import GridPoint
from defras_bt.recording.operator_state import Act, Mode
from defras_sim.geometry import Floats

# Less than this is the noise of a robot standing still, not somebody moving it.
MOVED_M = 1e-3

_SENTENCES = {
    Act.PAUSE: "The operator paused the operation: nothing moves, the grip is kept.",
    Act.RESUME: "The operator resumed the operation: a plan is made from what is true now.",
    Act.STOP: "The operator asked to stop: nothing moves, the grip is kept.",
    Act.TAKE_OVER: "The operator took over: nothing moves by itself until they hand back.",
    Act.HAND_BACK: "The operator handed back: a plan is made from what is true now.",
    Act.APPROVE: "The operator approved the plan.",
    Act.REFUSE: "The operator refused the plan.",
}


class Handover:
    """Tells what the operator did, and forgets what holds no more after it.

    Whatever plan there was when the operator let the operation go on is gone, begun or not: it was
    made for another situation. While an operator drives, arms may stand elsewhere, tissue may be
    held elsewhere or not at all; so the grasp points reached are forgotten when the arms are taken,
    and what was done to held tissue when an arm comes back with its tip moved.
    """

    def __init__(self, board: Blackboard, slot: PlanSlot | None) -> None:
        self._board = board
        self._slot = slot
        self._mode = Mode.AUTONOMOUS
        self._tips_m: dict[str, Floats] = {}
        self._held: dict[str, GridPoint] = {}

    def update(self) -> None:
        """Follow the operator's mode; call at the start of every tick, before the tree."""
        operator = self._board.inputs.operator
        for done in operator.acts:
            words = f' ("{done.words}")' if done.words else ""
            self._board.tell(
                "operator",
                f"{_SENTENCES[done.act]}{words}",
                "info" if done.act is Act.APPROVE else "warning",
                {"act": done.act.value, "source": done.source, "words": done.words},
            )
        before, self._mode = self._mode, operator.mode
        acts = {done.act for done in operator.acts}
        if before is not Mode.TAKEN_OVER and operator.mode is Mode.TAKEN_OVER:
            self._taken_over()
        # Within one long tick an operator may have had the arms and be done with them.
        if Act.HAND_BACK in acts:
            self._handed_back(unseen=before is not Mode.TAKEN_OVER)
        if acts & {Act.RESUME, Act.HAND_BACK}:
            if self._slot is not None:
                self._slot.clear()
            self._board.new_plan = None

    def _taken_over(self) -> None:
        board = self._board
        self._tips_m = self._tips_now()
        self._held = {arm: grip.point for arm, grip in board.grips.items()}
        board.at.clear()

    def _handed_back(self, *, unseen: bool) -> None:
        """``unseen``: nobody knows where the arms were before."""
        board = self._board
        changes = []
        for arm, tip_m in self._tips_now().items():
            way_m = np.inf if unseen else float(np.linalg.norm(tip_m - self._tips_m[arm]))
            if way_m > MOVED_M:
                if not unseen:
                    changes.append(f"{arm.upper()} stands {way_m * 1e3:.0f} mm from where it was")
                if arm in board.grips:
                    board.grips[arm].done = ()
                    board.grips[arm].starts_m.clear()
        held = {arm: grip.point for arm, grip in board.grips.items()}
        changes += [] if unseen else _grips_changed(self._held, held)
        # What was learned in vain was learned about another shape.
        board.last_learning = None
        board.unexplained = False
        board.at.clear()
        as_before = "nobody knows what changed" if unseen else "arms and grips are as they were"
        said = "; ".join(changes) or as_before
        board.tell("operator", f"Since the operator took over: {said}.", data={"changes": changes})

    def _tips_now(self) -> dict[str, Floats]:
        arms = self._board.inputs.observation.arms
        return {name: arm.tissue_from_tip.position_m.copy() for name, arm in arms.items()}


def _grips_changed(before: Mapping[str, GridPoint], now: Mapping[str, GridPoint]) -> list[str]:
    changes = []
    for arm in sorted({*before, *now}):
        if arm not in now:
            changes.append(f"{arm.upper()} does not hold the tissue any more")
        elif arm not in before:
            changes.append(f"{arm.upper()} holds the tissue at {now[arm]}")
        elif before[arm] != now[arm]:
            changes.append(
                f"{arm.upper()} holds the tissue at {now[arm]}, no more at {before[arm]}"
            )
    return changes
