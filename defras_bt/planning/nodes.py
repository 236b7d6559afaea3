"""Leaves that bring a plan: the one made before the operation, or a new one from what is true."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from py_trees.common import Status
from pydantic import Field

from defras_bt.acting.jaw import JAW_TOLERANCE_RAD
from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.reasons import Code, Remedy
from defras_bt.executive.recovery import RecoveryLeaf
from defras_bt.executive.registry import register_node
from defras_bt.planning.plan import MANOEUVRES, ArmSituation, GridPoint, Plan, Situation
from defras_bt.planning.planner import NoPlan
from defras_bt.planning.program import PlanningTimeout
from defras_sim.retraction import SEQUENCES
from defras_sim.worlds.protocol import JAW_OPEN_RAD

Manoeuvre = Literal["pull", "move", "fold"]


class ReplanParameters(NodeParameters):
    """``exposing``: the manoeuvres of a retraction; ``rehearse``: how many grasp points the twin
    may try in simulation before one is chosen (0: the optimisation decides alone)."""

    exposing: Annotated[tuple[Manoeuvre, ...], Field(min_length=1)] = ("pull", "move", "fold")
    rehearse: Annotated[int, Field(ge=0)] = 0


@dataclass(frozen=True)
class Proposal:
    """A plan that may wait for approval: ``exposing`` as in a Situation, and what it was made from.

    ``attached`` (holes,) was believed then.
    """

    plan: Plan
    exposing: tuple[str, ...]
    situation: Situation
    attached: NDArray[np.bool_]


class PlanSource(RecoveryLeaf):
    """Base of the leaves that bring plans."""

    remedy: ClassVar[Remedy] = Remedy.REPLAN

    def adopt(self, plan: Plan, why: str, exposing: tuple[str, ...]) -> Status:
        """Put ``plan`` in place for the coming ticks as soon as the operator approves it.

        ``exposing``: the manoeuvres after which it counts on seeing the region.
        """
        board = self.context.board
        approved = self.context.approve(plan)
        if approved is None:
            board.awaits_approval = True
            return self.run(
                Code.AWAITING_APPROVAL,
                f"a plan of {len(plan.actions)} actions waits for the operator's approval",
            )
        if not approved:
            board.operator_refused = "the operator did not approve the plan"
            return self.fail(Code.PLAN_REFUSED, board.operator_refused)
        board.new_plan = plan
        board.plan_exposing = exposing
        board.plan_belief = self.context.scene.attached
        board.tell("plan", why, data={"actions": [str(action) for action in plan.actions]})
        return self.succeed(Code.PLANNED, why)


@register_node
class UsePreoperativePlan(PlanSource):
    """Bring the plan made before the operation, once, at the start."""

    def recover(self) -> Status:
        board, plan = self.context.board, self.context.preoperative
        if plan is None:
            return self.fail(Code.NOTHING_PREPARED, "there is no plan from before the operation")
        if board.preoperative_used:
            return self.fail(
                Code.USED_ALREADY, "the plan from before the operation was used already"
            )
        exposing = tuple(a.name for a in plan.actions if a.name in MANOEUVRES)
        why = f"The plan made before the operation is used: {len(plan.actions)} actions."
        status = self.adopt(plan, why, exposing)
        # One that waits in vain, because the operator pauses meanwhile, may be shown again.
        board.preoperative_used = status != Status.RUNNING
        return status


@register_node
class Replan(PlanSource):
    """Plan anew from what is sensed now; grasp points that failed stay blocked."""

    Parameters = ReplanParameters
    parameters: ReplanParameters

    def initialise(self) -> None:
        self._proposal: Proposal | None = None

    def recover(self) -> Status:
        proposal = self._proposal
        if proposal is None or not self._still_fits(proposal):
            return self._propose()
        return self._adopt(proposal)

    def _still_fits(self, proposal: Proposal) -> bool:
        """Whether all is still as it was when the plan was made that waits for approval."""
        situation = self._situation(frozenset(), self.parameters.exposing)
        attached = self.context.scene.attached
        return situation == proposal.situation and np.array_equal(attached, proposal.attached)

    def _adopt(self, proposal: Proposal) -> Status:
        plan = proposal.plan
        why = f"A plan of {len(plan.actions)} actions was found."
        return self.adopt(plan, why, proposal.exposing)

    def _propose(self) -> Status:
        board = self.context.board
        first = board.plan is None and not board.preoperative_used
        self._block_exhausted()
        situation = self._situation(frozenset(), self.parameters.exposing)
        try:
            plan, exposing = (
                self._rehearsed() if self.parameters.rehearse else self._plan(frozenset())
            )
        except NoPlan as error:
            board.no_plan = str(error)
            return self.fail(Code.IMPOSSIBLE, str(error))
        except PlanningTimeout as error:
            return self.fail(Code.PLANNER_TIMED_OUT, f"the planner gave up: {error}")
        if not first:
            board.tell(
                "replan", f"Planned anew from what is true now: {len(plan.actions)} actions."
            )
        self._proposal = Proposal(plan, exposing, situation, self.context.scene.attached)
        return self._adopt(self._proposal)

    def _block_exhausted(self) -> None:
        """A retraction that ended without showing the region will not show it later."""
        board = self.context.board
        for arm, grip in board.grips.items():
            if board.plan_exposing and set(board.plan_exposing) <= set(grip.done):
                board.blocked.add(grip.point)
                board.tell(
                    "hold",
                    f"{arm.upper()} finished its retraction at {grip.point} and too little is "
                    "visible: this grasp point will not be used again.",
                )

    def _situation(self, skipped: frozenset[GridPoint], exposing: tuple[str, ...]) -> Situation:
        board = self.context.board
        arms = {}
        for name, arm in board.inputs.observation.arms.items():
            grip = board.grips.get(name)
            arms[name] = ArmSituation(
                at=board.at.get(name),
                holding=grip.point if grip else None,
                jaw_open=arm.jaw_rad >= JAW_OPEN_RAD - JAW_TOLERANCE_RAD,
                done=grip.done if grip else (),
            )
        # Where all of this was done and the region is still hidden, it cannot be the answer.
        spent = {grip.point for grip in board.grips.values() if set(exposing) <= set(grip.done)}
        return Situation(arms, frozenset(board.blocked | spent) | skipped, exposing)

    def _plan(
        self,
        skipped: frozenset[GridPoint],
        exposing: tuple[str, ...] | None = None,
        grasp: GridPoint | None = None,
    ) -> tuple[Plan, tuple[str, ...]]:
        """A plan, and the manoeuvres after which it counts on seeing the region."""
        situation = self._situation(skipped, exposing or self.parameters.exposing)
        plan = self.context.planner.plan(
            situation, self.context.scene.attached, required_grasp=grasp
        )
        return plan, situation.exposing

    def _rehearsed(self) -> tuple[Plan, tuple[str, ...]]:
        """The first plan in the planner's order of preference that exposes in simulation.

        If none does, the one that came closest: the model may be wrong, and looking tells.
        """
        skipped: frozenset[GridPoint] = frozenset()
        best: tuple[float, GridPoint, tuple[str, ...]] | None = None
        for _ in range(self.parameters.rehearse):
            try:
                plan, _ = self._plan(skipped)
            except NoPlan:
                if best is None:
                    raise
                break
            point = _grasp_point(plan)
            seen, exposing = self._outlook(point)
            if best is None or seen > best[0]:
                best = (seen, point, exposing)
            if seen >= self.context.scene.thresholds.roi_visibility:
                break
            skipped |= {point}
        assert best is not None, "rehearse is 1 or more"
        _, point, exposing = best
        return self._plan(frozenset(), exposing, point)

    def _outlook(self, point: GridPoint) -> tuple[float, tuple[str, ...]]:
        """Best simulated visibility of a retraction at ``point`` within the force threshold.

        With it the shortest manoeuvres that reach the goal, else the longest that come nearest.
        """
        done = next((g.done for g in self.context.board.grips.values() if g.point == point), ())
        limit_n = self.context.board.inputs.force_threshold_n
        wanted = self.context.scene.thresholds.roi_visibility
        best: tuple[float, tuple[str, ...]] = (-1.0, self.parameters.exposing)
        for sequence in SEQUENCES:
            if sequence[: len(done)] != done or sequence == done:
                continue
            rehearsal = self.context.rehearse(self.context.scene, point, sequence)
            seen = rehearsal.best_visibility if rehearsal.force_max_n <= limit_n else 0.0
            if seen >= best[0]:
                best = (seen, sequence)
            if seen >= wanted:
                break
        return best


def _grasp_point(plan: Plan) -> GridPoint:
    """The point at which ``plan`` holds the tissue in the end."""
    point = plan.actions[-1].point
    if point is None:
        raise ValueError(f"plan ends with {plan.actions[-1]}, which concerns no grasp point")
    return point


@register_node
class PlanFitsBelief(Node):
    """Succeeds while the plan was made with the attachments that are believed now."""

    role: ClassVar[Role] = "guard"

    def update(self) -> Status:
        made_with = self.context.board.plan_belief
        if made_with is None:
            return self.fail(Code.NO_PLAN, "there is no plan yet")
        # Of small arrays, bytes are compared in a tenth of the time, and this guard is asked often.
        if made_with.tobytes() != self.context.scene.attached.tobytes():
            return self.fail(
                Code.OUTDATED, "other attachments are believed than the plan was made with"
            )
        return self.succeed(Code.FITS, "the plan was made with what is believed now")
