"""Estimates the attachments by inverting the tissue model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.evidence import Evidence, compare
from defras_bt.learning.hold_out import Split, split
from defras_bt.learning.misfit import misfit
from defras_bt.learning.registration import fitted_registration
from defras_bt.learning.replay import NotRepeatable, Replay, hole_stiffness_n_per_m
from defras_bt.learning.search import AttachmentSearch, Mask, SearchResult, SearchSettings
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.seen import seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.state import TissueState


@dataclass(frozen=True)
class AdoptionRule:
    """What held-out points have to say before a proposal is believed.

    The gain has to be one that chance gives in fewer than ``chance`` of cases, at least
    ``relative_gain`` of the whole distance, at least ``local_gain_m`` where anything changes, and
    must not make the worst neighbourhood of any frame worse by more than ``worse_m``. A camera that
    stands elsewhere, fitted to the same points, must not do ``rival_share`` of it.
    """

    chance: float = 0.01
    relative_gain: float = 0.1
    local_gain_m: float = 0.0002
    worse_m: float = 0.0005
    rival_share: float = 0.7


@dataclass(frozen=True)
class InverseEstimator:
    """Searches the attachments that explain the keyframes on a coarse mesh of the tissue, then
    checks them on the scene's own mesh against points that were not fitted."""

    search: SearchSettings = field(default_factory=SearchSettings)
    rule: AdoptionRule = field(default_factory=AdoptionRule)
    search_cell_m: float = 0.02
    coarse_rounds: int = 8
    fine_rounds: int = 3
    most_fitted: int = 3
    least_travel_m: float = 0.005

    def estimate(
        self, belief: Scene, keyframes: Sequence[Keyframe], rng: np.random.Generator
    ) -> AttachmentEstimate:
        """Infer the attachments from frames of one grasp, in order of time; see the protocol."""
        if not keyframes:
            return _kept(belief, "no shape was observed since the grasp")
        parts = split(keyframes, self.most_fitted, self.least_travel_m)
        if not parts.fitted:
            return _kept(belief, "the tissue has not been moved far enough to tell anything")
        try:
            start = self._search_coarse(belief, keyframes, parts)
            replay = Replay(belief, keyframes)
            before = replay.repeat(hole_stiffness_n_per_m(belief.attached))
            found = self._search_fine(belief, replay, parts, start)
        except NotRepeatable as fault:
            return _kept(belief, f"the observed motion cannot be repeated: {fault}")
        if np.array_equal(found.attached, belief.attached):
            error = _mean_distance_m(belief, parts, before)
            reason = "no change of attachments explains the observed shapes better"
            return _kept(belief, reason, found, error)
        try:
            after = replay.repeat(hole_stiffness_n_per_m(found.attached))
        except NotRepeatable as fault:
            error = _mean_distance_m(belief, parts, before)
            return _kept(belief, f"the proposed attachments fail: {fault}", found, error)
        evidence = _judge(belief, parts, before, after, rng)
        worse = _worsening_m(belief, keyframes, before, after)
        objection = self._objection(evidence, worse) or self._rival(belief, parts, before, evidence)
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
        replay.repeat(hole_stiffness_n_per_m(belief.attached))
        return (
            self._searcher(belief, replay, parts).run(belief.attached, self.coarse_rounds).attached
        )

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

    def _objection(self, evidence: Evidence, worsening_m: float) -> str | None:
        """Why the proposal is not believed; None if it is."""
        rule = self.rule
        change = (
            f"points that were not fitted go from {1e3 * evidence.before_m:.2f} to "
            f"{1e3 * evidence.after_m:.2f} mm"
        )
        if evidence.chance > rule.chance:
            return f"attachments do not explain this: {change}, which chance may do as well"
        if evidence.relative_gain < rule.relative_gain or (
            evidence.local_gain_m < rule.local_gain_m
        ):
            return f"attachments do not explain this: {change}, too little to matter"
        if worsening_m > rule.worse_m:
            return (
                f"attachments do not explain this: {change}, but the worst place gets "
                f"{1e3 * worsening_m:.1f} mm worse"
            )
        return None

    def _rival(
        self, belief: Scene, parts: Split, before: Sequence[TissueState], evidence: Evidence
    ) -> str | None:
        """Whether a misplaced camera explains the same; None if it does not."""
        surfaces = [before[frame].surface for frame in parts.fitted]
        moved = fitted_registration(parts.fitted_points_m, surfaces, belief.depth_camera)
        if moved is None:
            return None
        aligned = replace(
            parts, judging_points_m=tuple(moved.apply(p) for p in parts.judging_points_m)
        )
        rival_m = _mean_distance_m(belief, aligned, before)
        gain = evidence.before_m - evidence.after_m
        if evidence.before_m - rival_m < self.rule.rival_share * gain:
            return None
        shift_mm = 1e3 * float(np.linalg.norm(moved.position_m))
        return (
            f"attachments do not explain this: a camera that stands {shift_mm:.1f} mm elsewhere "
            f"brings points that were not fitted from {1e3 * evidence.before_m:.2f} to "
            f"{1e3 * rival_m:.2f} mm, other attachments to {1e3 * evidence.after_m:.2f} mm"
        )


def _kept(
    belief: Scene, reason: str, found: SearchResult | None = None, error_m: float = float("nan")
) -> AttachmentEstimate:
    attached: Mask = belief.attached
    probability = found.probability if found is not None else attached.astype(float)
    return AttachmentEstimate(attached, probability, error_m, error_m, False, reason)


def _distances_m(
    belief: Scene, parts: Split, states: Sequence[TissueState]
) -> tuple[Floats, Floats]:
    """Distance (n,) of every judging point, and where on the resting tissue (n, 2) it is seen."""
    distances, places = [], []
    for points, state in zip(parts.judging_points_m, states, strict=True):
        compared = misfit(points, state.surface, belief.depth_camera)
        if compared is None:
            raise NotRepeatable("the model's tissue leaves the depth camera's picture")
        distances.append(np.abs(compared.residual_m))
        rest = state.surface.rest_xy_m[compared.vertices]
        places.append(np.einsum("nk,nkd->nd", compared.weights, rest))
    return np.concatenate(distances), np.concatenate(places)


def _mean_distance_m(belief: Scene, parts: Split, states: Sequence[TissueState]) -> float:
    return float(_distances_m(belief, parts, states)[0].mean())


def _judge(
    belief: Scene,
    parts: Split,
    before: Sequence[TissueState],
    after: Sequence[TissueState],
    rng: np.random.Generator,
) -> Evidence:
    before_m, places = _distances_m(belief, parts, before)
    after_m, _ = _distances_m(belief, parts, after)
    return compare(before_m, after_m, places, rng)


def _worsening_m(
    belief: Scene,
    keyframes: Sequence[Keyframe],
    before: Sequence[TissueState],
    after: Sequence[TissueState],
) -> float:
    """How much worse the worst neighbourhood of all frames gets; what monitoring will look at."""
    metric = LocalMetric()

    def worst(states: Sequence[TissueState]) -> float:
        return max(
            metric.measure(frame.cloud_m, seen_surface(state.surface, belief.depth_camera)).value_m
            for frame, state in zip(keyframes, states, strict=True)
        )

    return worst(after) - worst(before)
