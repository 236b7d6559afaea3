"""Estimates the attachments by inverting the tissue model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.learning.adoption import AdoptionRule
from defras_bt.learning.coarse_search import CELL_M, ROUNDS, coarse_search
from defras_bt.learning.cost import SearchSettings
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.hold_out import Split, split
from defras_bt.learning.judging import Case, kept
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.search import AttachmentSearch, Mask, SearchResult
from defras_sim.scene import Scene


@dataclass(frozen=True)
class InverseEstimator:
    """Searches the attachments that explain the keyframes, on a coarse mesh of the tissue and then
    on the scene's own, and checks them there against points that were not fitted.

    ``search_cell_m`` is the element size of the coarse mesh; ``most_fitted`` frames are fitted;
    frames whose tips moved less than ``least_travel_m`` since the grasp show nothing.
    """

    search: SearchSettings = field(default_factory=SearchSettings)
    rule: AdoptionRule = field(default_factory=AdoptionRule)
    search_cell_m: float = CELL_M
    coarse_rounds: int = ROUNDS
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
            return kept(belief, "no shape was observed since the grasp")
        parts = split(keyframes, self.most_fitted, self.least_travel_m)
        if not parts.fitted:
            return kept(belief, "the tissue has not been moved far enough to tell anything")
        try:
            start = coarse_search(
                belief, keyframes, parts, self.search, self.search_cell_m, self.coarse_rounds
            )
            case = Case.of(belief, keyframes, parts)
            found = self._search_fine(belief, case.replay, parts, start)
        except NotRepeatable as fault:
            return kept(belief, f"the observed motion cannot be repeated: {fault}")
        return case.judged(found.attached, found.probability, self.rule, rng)

    def _search_fine(
        self, belief: Scene, replay: Replay, parts: Split, start: Mask
    ) -> SearchResult:
        """The last steps from the better of ``start`` and the belief, on the scene's own mesh."""
        points, frames = parts.fitted_points_m, parts.fitted
        searcher = AttachmentSearch(belief, replay, points, frames, self.search)
        better = start if searcher.cost(start) < searcher.cost(belief.attached) else belief.attached
        return searcher.run(better, self.fine_rounds)
