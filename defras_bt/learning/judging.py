"""From a proposed set of attachments to an answer: repeated, judged, and put into words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.learning.adoption import AdoptionRule, Hearing, distances_m
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.evidence import Evidence, compare
from defras_bt.learning.hold_out import Split
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.search import Mask
from defras_bt.learning.unknown_pull import best_pull
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.state import TissueState


@dataclass(frozen=True)
class Case:
    """What a proposal is judged on: the belief with its shapes ``before`` at the keyframes, and
    which points judge. ``replay`` is on the scene's own mesh."""

    belief: Scene
    keyframes: Sequence[Keyframe]
    parts: Split
    replay: Replay
    before: Sequence[TissueState]

    @staticmethod
    def of(belief: Scene, keyframes: Sequence[Keyframe], parts: Split) -> Case:
        """Repeat the motion under the belief.

        Raises:
            NotRepeatable: the model cannot follow it.
        """
        replay = Replay(belief, keyframes)
        before = replay.repeat(belief.hole_stiffness_n_per_m(belief.attached))
        return Case(belief, keyframes, parts, replay, before)

    @property
    def before_m(self) -> float:
        """Mean distance of the judging points under the belief; NaN where there are none.

        Raises:
            NotRepeatable: the camera sees nothing of a shape.
        """
        camera, points = self.belief.depth_camera, self.parts.judging_points_m
        distance_m = distances_m(camera, points, self.before)[0]
        return float(distance_m.mean()) if len(distance_m) else float("nan")

    def judged(
        self, attached: Mask, probability: Floats, rule: AdoptionRule, rng: np.random.Generator
    ) -> AttachmentEstimate:
        """Whether ``attached`` (holes,) is believed instead, and why. ``rng`` draws the
        permutations of the test for chance."""
        belief = self.belief
        try:
            before_m = self.before_m
        except NotRepeatable as fault:
            return kept(belief, f"the observed motion cannot be repeated: {fault}", probability)
        if not np.isfinite(before_m):
            why = "nothing of the tissue was seen that estimates are not fitted to"
            return kept(belief, why, probability)
        if np.array_equal(attached, belief.attached):
            why = "no change of attachments explains the observed shapes better"
            return kept(belief, why, probability, before_m)
        try:
            after = self.replay.repeat(belief.hole_stiffness_n_per_m(attached))
            hearing = Hearing(belief.depth_camera, self.keyframes, self.parts, self.before, after)
            evidence = hearing.evidence(rng)
            objection = hearing.objection(rule, evidence)
            if objection is None and hearing.explained(evidence) < rule.beyond_doubt:
                objection = self._pulled(after, evidence, rule, rng)
        except NotRepeatable as fault:
            return kept(belief, f"the proposed attachments fail: {fault}", probability, before_m)
        changed = int(np.sum(attached != belief.attached))
        return AttachmentEstimate(
            attached=attached if objection is None else belief.attached,
            probability=probability,
            held_out_before_m=evidence.before_m,
            held_out_after_m=evidence.after_m,
            adopted=objection is None,
            reason=objection
            or f"{changed} changed holes bring points that were not fitted from "
            f"{1e3 * evidence.before_m:.2f} to {1e3 * evidence.after_m:.2f} mm",
        )

    def _pulled(
        self,
        after: Sequence[TissueState],
        evidence: Evidence,
        rule: AdoptionRule,
        rng: np.random.Generator,
    ) -> str | None:
        """Why something unknown that pulls explains the points better; None where it does not."""
        pull = best_pull(self.belief, self.keyframes, self.replay, self.parts)
        points_m = self.parts.judging_points_m
        after_m, rest_xy_m = distances_m(self.belief.depth_camera, points_m, after)
        rival = compare(after_m, np.abs(pull.residual_m), rest_xy_m, rng)
        if rival.chance > rule.pull_chance or rival.local_gain_m < rule.pull_gain_m:
            return None
        x, y, _ = 1e3 * pull.place_m
        return (
            f"attachments do not explain this: points that were not fitted go from "
            f"{1e3 * evidence.before_m:.2f} to {1e3 * evidence.after_m:.2f} mm, but something "
            f"unknown that pulls at ({x:.0f}, {y:.0f}) mm would explain it better"
        )


def kept(
    belief: Scene,
    reason: str,
    probability: Floats | None = None,
    error_m: float = float("nan"),
) -> AttachmentEstimate:
    """The belief stays; without ``probability`` (holes,) it is what it was."""
    attached = belief.attached
    said = attached.astype(float) if probability is None else probability
    return AttachmentEstimate(attached, said, error_m, error_m, False, reason)
