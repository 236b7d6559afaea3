"""The leaf that learns attachments from what was seen since the grasp."""

from __future__ import annotations

from typing import ClassVar

from py_trees.common import Status

from defras_bt.executive.blackboard import LearningAttempt
from defras_bt.executive.context import Context
from defras_bt.executive.node import NodeParameters
from defras_bt.executive.reasons import Code, Remedy
from defras_bt.executive.recovery import RecoveryLeaf
from defras_bt.executive.registry import register_node
from defras_bt.learning.chain.estimators import EstimatorName


class LearnParameters(NodeParameters):
    """``estimator``: who infers the attachments; ``chain`` lets a network propose, the tissue model
    refine, and held-out points decide."""

    estimator: EstimatorName = "chain"


@register_node
class LearnAttachments(RecoveryLeaf):
    """Estimate the attachments; adopt them only if they explain what was not fitted."""

    remedy: ClassVar[Remedy] = Remedy.LEARN
    Parameters = LearnParameters
    parameters: LearnParameters

    def __init__(self, name: str, context: Context, parameters: LearnParameters) -> None:
        """
        Raises:
            NoWeights: the weights of the estimator's network are missing, or others than its card
                says: better before the operation than in it.
        """
        super().__init__(name, context, parameters)
        self._estimator = context.estimator(parameters.estimator)

    def recover(self) -> Status:
        board, context = self.context.board, self.context
        frames = context.keyframes.frames()
        if not frames:
            return self._cannot_learn()
        arms = board.inputs.observation.arms
        board.last_learning = LearningAttempt(
            tick=board.inputs.tick,
            warning_state=board.warning_state or 0,
            tips_m={name: arm.tissue_from_tip.position_m for name, arm in arms.items()},
        )
        estimate = self._estimator.estimate(context.scene, frames, context.rng)
        board.posterior = estimate
        before_mm, after_mm = estimate.held_out_before_m * 1e3, estimate.held_out_after_m * 1e3
        data = {
            "adopted": estimate.adopted,
            "held_out_before_m": estimate.held_out_before_m,
            "held_out_after_m": estimate.held_out_after_m,
        }
        if not estimate.adopted:
            board.unexplained = True
            board.tell("learning", f"Attachments kept: {estimate.reason}", "warning", data)
            return self.fail(Code.REJECTED, estimate.reason)
        changed = int((estimate.attached != context.scene.attached).sum())
        context.twin.set_attached(estimate.attached)
        context.monitor.twin_changed()
        board.unexplained = False
        board.tell(
            "learning",
            f"Attachments learned: {changed} holes changed; the model now misses unseen points by "
            f"{after_mm:.1f} mm instead of {before_mm:.1f} mm.",
            "info",
            data,
        )
        return self.succeed(Code.ADOPTED, estimate.reason)

    def _cannot_learn(self) -> Status:
        """Without a shape the mismatch stays unexplained, and a grip under it unsafe."""
        board, why = self.context.board, "no shape of the tissue was seen since the grasp"
        if not board.unexplained:
            board.unexplained = True
            board.tell(
                "warning", f"Nothing can be learned about the attachments: {why}.", "warning"
            )
        return self.fail(Code.NO_SHAPES, why)
