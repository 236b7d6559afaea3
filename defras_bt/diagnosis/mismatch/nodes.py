"""Leaves that ask what explains a mismatch before attachments are changed, and act on it."""

from __future__ import annotations

from typing import ClassVar

from py_trees.common import Status

from defras_bt.diagnosis.mismatch.finding import MismatchCause
from defras_bt.executive.blackboard import LearningAttempt
from defras_bt.executive.context import Context
from defras_bt.executive.node import Node, NodeParameters, Role
from defras_bt.executive.reasons import Code, Remedy
from defras_bt.executive.recovery import RecoveryLeaf
from defras_bt.executive.registry import register_node
from defras_bt.learning.chain.estimators import EstimatorName


class DiagnoseParameters(NodeParameters):
    """``estimator``: who infers the attachments that other causes are held against."""

    estimator: EstimatorName = "chain"


class CauseParameters(NodeParameters):
    """``cause``: who may be to blame."""

    cause: MismatchCause


@register_node
class DiagnoseMismatch(RecoveryLeaf):
    """Find out if attachments, grasp, camera or arm explain best what was seen since the grasp.

    Succeeds whoever is to blame: MismatchIs tells. Attachments are blamed where nothing else
    explains enough, or nothing was seen.
    """

    remedy: ClassVar[Remedy] = Remedy.LEARN
    answers: ClassVar[frozenset[Status]] = frozenset({Status.SUCCESS, Status.FAILURE})
    Parameters = DiagnoseParameters
    parameters: DiagnoseParameters

    def __init__(self, name: str, context: Context, parameters: DiagnoseParameters) -> None:
        """
        Raises:
            NoWeights: as of LearnAttachments.
        """
        super().__init__(name, context, parameters)
        self._estimator = context.estimator(parameters.estimator)

    def recover(self) -> Status:
        board, context = self.context.board, self.context
        arms = board.inputs.observation.arms
        board.last_learning = LearningAttempt(
            tick=board.inputs.tick,
            warning_state=board.warning_state or 0,
            tips_m={name: arm.tissue_from_tip.position_m for name, arm in arms.items()},
        )
        found = context.mismatch.explain(
            context.scene, context.keyframes.frames(), context.rng, self._estimator
        )
        board.mismatch = found
        if found.cause != "attachments":
            data = {
                "cause": found.cause,
                "explained": dict(found.explained),
                "before_m": found.before_m,
                "after_m": found.after_m,
            }
            known = "cannot be told yet" if found.cause == "unclear" else "was found"
            told = f"What does not fit {known}: {found.sentence}."
            board.tell("diagnosis", told, "warning", data)
        return self.succeed(Code.DIAGNOSED, f"{found.cause}: {found.sentence}")


@register_node
class MismatchIs(Node):
    """Succeeds if the last diagnosis since the grasp blamed ``cause`` for the mismatch."""

    role: ClassVar[Role] = "guard"
    answers: ClassVar[frozenset[Status]] = frozenset({Status.SUCCESS, Status.FAILURE})
    Parameters = CauseParameters
    parameters: CauseParameters

    def update(self) -> Status:
        found = self.context.board.mismatch
        if found is None:
            return self.fail(Code.NOT_BLAMED, "nobody has looked into a mismatch since the grasp")
        if found.cause != self.parameters.cause:
            return self.fail(Code.NOT_BLAMED, f"the mismatch is put down to: {found.cause}")
        return self.succeed(Code.BLAMED, found.sentence)


@register_node
class RegisterCamera(RecoveryLeaf):
    """Believe that the depth camera stands where the last diagnosis found it."""

    remedy: ClassVar[Remedy] = Remedy.LEARN
    answers: ClassVar[frozenset[Status]] = frozenset({Status.SUCCESS, Status.FAILURE})

    def recover(self) -> Status:
        board, context = self.context.board, self.context
        found = board.mismatch
        if found is None or found.true_from_reported is None:
            return self.fail(Code.NOT_BLAMED, "the camera was not found to have moved")
        try:
            context.twin.register_camera(found.true_from_reported)
        except ValueError as fault:
            board.unexplained = True
            return self.fail(Code.REJECTED, f"the camera cannot stand there: {fault}")
        context.monitor.camera_registered()
        # Kept shapes were seen by the camera as it was believed to stand.
        context.keyframes.clear()
        board.mismatch = None
        board.unexplained = False
        board.tell("diagnosis", f"The camera was registered anew: {found.sentence}.", "warning")
        return self.succeed(Code.REGISTERED, found.sentence)
