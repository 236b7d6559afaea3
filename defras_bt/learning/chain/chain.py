"""Propose, refine, verify: networks say where to look, the tissue model what is so, and points that
neither was fitted to whether to believe it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.learning.adoption import AdoptionRule
from defras_bt.learning.chain.candidates import candidate_sets, open_questions
from defras_bt.learning.coarse_search import coarse_search
from defras_bt.learning.cost import SearchSettings
from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.hold_out import split
from defras_bt.learning.judging import Case, kept
from defras_bt.learning.networks.propose import Proposal, Proposer
from defras_bt.learning.prediction import Predicted
from defras_bt.learning.replay import NotRepeatable
from defras_bt.learning.search import AttachmentSearch, Mask, SearchResult
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

_SUREST = 1e-4
"""Nearer to certainty no opinion counts."""


@dataclass(frozen=True)
class ChainEstimator:
    """Networks propose, the inverse estimate goes on from the best proposal, and the result is
    believed only if it beats the belief on what it was not fitted to.

    ``proposers`` are asked in turn. ``sure``: a hole is changed in a proposal where its network
    says with such a probability that it is otherwise than believed. The search changes at most
    ``most_holes`` holes, of those to which a network gives a chance of ``least_doubt`` or more.
    Where it leaves more than ``enough_m`` (root mean square of the fitted cells, half of what the
    model itself may be off by) the networks were wrong, and the search begins again without them.
    """

    proposers: tuple[Proposer, ...]
    search: SearchSettings = field(default_factory=SearchSettings)
    rule: AdoptionRule = field(default_factory=AdoptionRule)
    sure: tuple[float, ...] = (0.5, 0.75)
    least_doubt: float = 0.004
    most_holes: int = 90
    rounds: int = 4
    most_fitted: int = 3
    least_travel_m: float = 0.003
    enough_m: float = 0.0005

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
            proposals = self._proposals(case)
            found, believed = self._refined(case, proposals)
        except NotRepeatable as fault:
            return kept(belief, f"the observed motion cannot be repeated: {fault}")
        said = [proposal.probability for proposal in believed[:1]]
        probability = pooled([*said, found.probability], belief.is_hole)
        return case.judged(found.attached, probability, self.rule, rng)

    def _proposals(self, case: Case) -> list[Proposal]:
        predicted = Predicted.of(case.replay.rest_surface, case.before)
        asked = [each.propose(case.belief, case.keyframes, predicted) for each in self.proposers]
        return [proposal for proposal in asked if proposal is not None]

    def _refined(
        self, case: Case, proposals: Sequence[Proposal]
    ) -> tuple[SearchResult, Sequence[Proposal]]:
        """The inverse estimate from the set that explains the fitted points best, and the proposals
        that it came from: none where it is better without."""
        found = self._searched(case, proposals)
        if not proposals or found.left_m <= self.enough_m:
            return found, proposals
        try:
            start = coarse_search(case.belief, case.keyframes, case.parts, self.search)
            again = self._searcher(case).run(start, self.rounds)
        except NotRepeatable:
            # Only the other beginning is lost; whether the first one's end is believed is judged.
            return found, proposals
        return (again, ()) if again.cost_after < found.cost_after else (found, proposals)

    def _searched(self, case: Case, proposals: Sequence[Proposal]) -> SearchResult:
        belief = case.belief
        sets = candidate_sets(belief, proposals, self.sure)
        asked = open_questions(belief, proposals, sets, self.most_holes, self.least_doubt)
        searcher = self._searcher(case, asked if proposals else None)
        best, lowest = belief.attached, searcher.cost(belief.attached)
        for each in sets:
            cost = searcher.cost(each)
            if cost < lowest:
                best, lowest = each, cost
        return searcher.run(best, self.rounds)

    def _searcher(self, case: Case, considered: Mask | None = None) -> AttachmentSearch:
        points_m, frames = case.parts.fitted_points_m, case.parts.fitted
        return AttachmentSearch(case.belief, case.replay, points_m, frames, self.search, considered)


def pooled(opinions: Sequence[Floats], is_hole: Mask) -> Floats:
    """Probability (holes,) out of several ``opinions`` (holes,), 0 where there is no hole: the mean
    of their log odds (logarithmic opinion pool, Genest and Zidek 1986).

    A network is too sure where it has seen little, and a search not sure enough where points say
    nothing. They judge the same points, so their evidence must not be added.
    """
    kept = np.clip(np.array(opinions), _SUREST, 1.0 - _SUREST)
    log_odds = np.mean(np.log(kept / (1.0 - kept)), axis=0)
    return np.where(is_hole, 1.0 / (1.0 + np.exp(-log_odds)), 0.0)
