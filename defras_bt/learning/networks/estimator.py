"""A network alone as an estimator: what it says is believed if the points agree better with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.learning.adoption import AdoptionRule
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.hold_out import split
from defras_bt.learning.judging import Case, kept
from defras_bt.learning.networks.propose import Proposer
from defras_bt.learning.prediction import Predicted
from defras_bt.learning.replay import NotRepeatable
from defras_sim.scene import Scene

BETTER = AdoptionRule(
    chance=1.0,
    relative_gain=0.0,
    explained=-np.inf,
    local_gain_m=0.0,
    worse_m=np.inf,
    rival_share=np.inf,
    beyond_doubt=-np.inf,
)
"""The least that an update has to do: make the model agree better with the judging points."""


@dataclass(frozen=True)
class NetworkEstimator:
    """What ``proposer`` holds for more likely than not, if it makes the model agree better.

    No network was fitted to any of the points, but some are held out as in the other estimators,
    so that errors compare.
    """

    proposer: Proposer
    rule: AdoptionRule = BETTER
    most_fitted: int = 3
    least_travel_m: float = 0.003

    def estimate(
        self, belief: Scene, keyframes: Sequence[Keyframe], rng: np.random.Generator
    ) -> AttachmentEstimate:
        """See :class:`defras_bt.learning.estimate.AttachmentEstimator`."""
        if not keyframes:
            return kept(belief, "no shape was observed since the grasp")
        parts = split(keyframes, self.most_fitted, self.least_travel_m)
        if not parts.fitted:
            return kept(belief, "the tissue has not been moved far enough to tell anything")
        try:
            case = Case.of(belief, keyframes, parts)
        except NotRepeatable as fault:
            return kept(belief, f"the observed motion cannot be repeated: {fault}")
        predicted = Predicted.of(case.replay.rest_surface, case.before)
        proposal = self.proposer.propose(belief, keyframes, predicted)
        if proposal is None:
            return kept(belief, "the camera sees nothing of the model's tissue")
        return case.judged(proposal.probability > 0.5, proposal.probability, self.rule, rng)
