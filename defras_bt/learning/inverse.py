"""Estimates the attachments by inverting the tissue model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.learning.adoption import AdoptionRule, Hearing, distances_m
from defras_bt.learning.cost import SearchSettings
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.hold_out import Split, split
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.search import AttachmentSearch, Mask, SearchResult
from defras_sim.scene import Scene
from defras_sim.tissue.state import TissueState


@dataclass(frozen=True)
class InverseEstimator:
    """Searches the attachments that explain the keyframes, on a coarse mesh of the tissue and then
    on the scene's own, and checks them there against points that were not fitted.

    ``search_cell_m`` is the element size of the coarse mesh; ``most_fitted`` frames are fitted;
    frames whose tips moved less than ``least_travel_m`` since the grasp show nothing.
    """

    search: SearchSettings = field(default_factory=SearchSettings)
    rule: AdoptionRule = field(default_factory=AdoptionRule)
    search_cell_m: float = 0.02
    coarse_rounds: int = 8
    fine_rounds: int = 3
    most_fitted: int = 3
    least_travel_m: float = 0.003

    def estimate(
        self, belief: Scene, keyframes: Sequence[Keyframe], rng: np.random.Generator
    ) -> AttachmentEstimate:
        """Infer the attachments from frames of one grasp, in order of time.

        ``rng`` draws the permutations of the test for chance; the same one gives the same answer.
        """
        if not keyframes:
            return _kept(belief, "no shape was observed since the grasp")
        parts = split(keyframes, self.most_fitted, self.least_travel_m)
        if not parts.fitted:
            return _kept(belief, "the tissue has not been moved far enough to tell anything")
        try:
            start = self._search_coarse(belief, keyframes, parts)
            replay = Replay(belief, keyframes)
            before = replay.repeat(belief.hole_stiffness_n_per_m(belief.attached))
            found = self._search_fine(belief, replay, parts, start)
            before_m = _judging_distance_m(belief, parts, before)
        except NotRepeatable as fault:
            return _kept(belief, f"the observed motion cannot be repeated: {fault}")
        if np.array_equal(found.attached, belief.attached):
            reason = "no change of attachments explains the observed shapes better"
            return _kept(belief, reason, found, before_m)
        try:
            after = replay.repeat(belief.hole_stiffness_n_per_m(found.attached))
            hearing = Hearing(belief.depth_camera, keyframes, parts, before, after)
            evidence = hearing.evidence(rng)
            objection = hearing.objection(self.rule, evidence)
        except NotRepeatable as fault:
            return _kept(belief, f"the proposed attachments fail: {fault}", found, before_m)
        changed = int(np.sum(found.attached != belief.attached))
        return AttachmentEstimate(
            attached=found.attached if objection is None else belief.attached,
            probability=found.probability,
            held_out_before_m=evidence.before_m,
            held_out_after_m=evidence.after_m,
            adopted=objection is None,
            reason=objection
            or f"{changed} changed holes bring points that were not fitted from "
            f"{1e3 * evidence.before_m:.2f} to {1e3 * evidence.after_m:.2f} mm",
        )

    def _search_coarse(self, belief: Scene, keyframes: Sequence[Keyframe], parts: Split) -> Mask:
        """Most of the way, on a mesh on which a round takes a fraction of a second."""
        tissue = belief.tissue
        cells = np.array([tissue.length_x_m, tissue.width_y_m]) / self.search_cell_m
        x, y = (max(2, int(np.ceil(count - 1e-9))) for count in cells)
        coarse = (x, y, 1) if tissue.element == "hexahedron20" else tissue.elements_xyz
        replay = Replay(belief, keyframes, coarse)
        replay.repeat(belief.hole_stiffness_n_per_m(belief.attached))
        searcher = self._searcher(belief, replay, parts)
        return searcher.run(belief.attached, self.coarse_rounds).attached

    def _search_fine(
        self, belief: Scene, replay: Replay, parts: Split, start: Mask
    ) -> SearchResult:
        """The last steps from the better of ``start`` and the belief, on the scene's own mesh."""
        searcher = self._searcher(belief, replay, parts)
        better = start if searcher.cost(start) < searcher.cost(belief.attached) else belief.attached
        return searcher.run(better, self.fine_rounds)

    def _searcher(self, belief: Scene, replay: Replay, parts: Split) -> AttachmentSearch:
        points, frames = parts.fitted_points_m, parts.fitted
        return AttachmentSearch(belief, replay, points, frames, self.search)


def _kept(
    belief: Scene, reason: str, found: SearchResult | None = None, error_m: float = float("nan")
) -> AttachmentEstimate:
    attached: Mask = belief.attached
    probability = found.probability if found is not None else attached.astype(float)
    return AttachmentEstimate(attached, probability, error_m, error_m, False, reason)


def _judging_distance_m(belief: Scene, parts: Split, shapes: Sequence[TissueState]) -> float:
    distance, _ = distances_m(belief.depth_camera, parts.judging_points_m, shapes)
    return float(distance.mean())
