"""Which of attachments, grasp, camera and arm explains best what was seen since the grasp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.diagnosis.mismatch.finding import MismatchCause, MismatchFinding
from defras_bt.diagnosis.mismatch.rivals import (
    STILL,
    Rival,
    moved_arms,
    moved_cameras,
    moved_patches,
)
from defras_bt.learning.estimate import AttachmentEstimator, Keyframe
from defras_bt.learning.evidence import compare
from defras_bt.learning.hold_out import Split, split
from defras_bt.learning.misfit import misfit
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene

_TOLD: Mapping[MismatchCause, str] = {
    "grasp": "the tissue slipped in the jaw {size}",
    "camera": "the depth camera was moved {size}",
    "arm": "the tip is not where it is told to be: what it holds is off {size}",
}


@dataclass(frozen=True)
class MismatchRule:
    """The least that a rival of the attachments has to do on points that it was not fitted to.

    Of the mean distance above the camera's noise ``explained``, of the whole ``relative_gain``,
    where chance would give as much in fewer than ``chance`` of cases; and attachments, fitted to
    the same points, may not leave less than ``attachments_better`` of what it leaves, nor less than
    it does at all where no more than ``few_holes`` hold otherwise than believed: then they have no
    more numbers to bend than a rival.
    """

    explained: float = 0.6
    relative_gain: float = 0.1
    chance: float = 0.01
    attachments_better: float = 0.85
    few_holes: int = 3


@dataclass(frozen=True)
class _Judged:
    rival: Rival
    after_m: float
    explained: float
    credible: bool


@dataclass(frozen=True)
class MismatchRanking:
    """Fits each rival to some of the points, and judges it on the others.

    Attachments have many parameters and can be bent to explain a little of everything; a slip, a
    moved camera or an arm that is off have few. So attachments are blamed where none of these
    explains enough, or where they explain more. A camera is not moved while attachments explain as
    much, however they came to: seen through a camera that is wrongly moved, nothing fits any more.
    """

    rule: MismatchRule = field(default_factory=MismatchRule)
    most_fitted: int = 3
    least_travel_m: float = 0.003

    def explain(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        rng: np.random.Generator,
        estimator: AttachmentEstimator,
    ) -> MismatchFinding:
        """See :class:`defras_bt.diagnosis.mismatch.finding.MismatchService`."""
        if not keyframes:
            return _attachments("no shape was observed since the grasp")
        parts = split(keyframes, self.most_fitted, self.least_travel_m)
        if not parts.fitted:
            return _attachments("the tissue has not been moved far enough to tell anything")
        replay = Replay(belief, keyframes)
        try:
            states = replay.repeat(belief.hole_stiffness_n_per_m(belief.attached))
        except NotRepeatable as fault:
            return _attachments(f"the observed motion cannot be repeated: {fault}")
        surfaces = tuple(state.surface for state in states)
        camera = belief.depth_camera
        fitted = [np.zeros((0, 3)) for _ in keyframes]
        for frame in parts.fitted:
            fitted[frame] = parts.fitted_points_m[parts.fitted.index(frame)]
        plain = Rival("attachments", surfaces, (STILL,) * len(surfaces), "")
        rivals = [
            *moved_cameras(fitted, surfaces, camera),
            *moved_patches(fitted, replay, keyframes, surfaces, camera),
            *moved_arms(fitted, belief, keyframes, surfaces),
        ]
        before = _distances(plain, parts, camera)
        if before is None:
            return _attachments("the model's tissue leaves the depth camera's picture")
        before_m = float(before[0].mean())
        noise_m = min(_quietest_m(rival, keyframes, camera) for rival in (plain, *rivals))
        judged = [
            each
            for rival in rivals
            if (each := self._judged(rival, before, noise_m, parts, camera, rng)) is not None
        ]
        shares = {
            cause: max((j.explained for j in judged if j.rival.cause == cause), default=0.0)
            for cause in _TOLD
        }
        best = min((j for j in judged if j.credible), key=lambda j: j.after_m, default=None)
        if best is None:
            return _attachments("nothing else explains it", before_m, shares)
        learned = estimator.estimate(belief, keyframes, rng)
        changed = int(np.count_nonzero(learned.attached != belief.attached))
        share = 1.0 if changed <= self.rule.few_holes else self.rule.attachments_better
        limit_m = share * best.after_m
        if learned.adopted and learned.held_out_after_m < limit_m:
            return _attachments(
                "attachments explain it better than anything else", before_m, shares
            )
        if best.rival.cause == "camera" and learned.held_out_after_m < best.after_m:
            return MismatchFinding(
                "unclear",
                f"a camera that was moved {best.rival.size} would bring points that were not "
                f"fitted from {1e3 * before_m:.2f} to {1e3 * best.after_m:.2f} mm, and other "
                f"attachments to {1e3 * learned.held_out_after_m:.2f} mm: more has to be seen",
                before_m,
                best.after_m,
                shares,
            )
        cause: MismatchCause = best.rival.cause
        told = _TOLD[cause].format(size=best.rival.size)
        return MismatchFinding(
            cause=cause,
            sentence=(
                f"{told}; points that were not fitted go from {1e3 * before_m:.1f} to "
                f"{1e3 * best.after_m:.1f} mm"
            ),
            before_m=before_m,
            after_m=best.after_m,
            explained=shares,
            true_from_reported=best.rival.moved[-1] if cause == "camera" else None,
        )

    def _judged(
        self,
        rival: Rival,
        before: tuple[Floats, Floats],
        noise_m: float,
        parts: Split,
        camera: Camera,
        rng: np.random.Generator,
    ) -> _Judged | None:
        """``rival`` on the held-out points, beside the distances ``before``."""
        after = _distances(rival, parts, camera)
        if after is None:
            return None
        evidence = compare(before[0], after[0], before[1], rng)
        excess_m = evidence.before_m - noise_m
        explained = (evidence.before_m - evidence.after_m) / excess_m if excess_m > 0 else 0.0
        credible = (
            explained >= self.rule.explained
            and evidence.relative_gain >= self.rule.relative_gain
            and evidence.chance <= self.rule.chance
        )
        return _Judged(rival, evidence.after_m, explained, credible)


def _distances(rival: Rival, parts: Split, camera: Camera) -> tuple[Floats, Floats] | None:
    """Distance (n,) of all judging points and where on the resting tissue (n, 2) they lie; None
    where the camera would see nothing."""
    distances, places = [], []
    for points_m, surface, pose in zip(
        parts.judging_points_m, rival.surfaces, rival.moved, strict=True
    ):
        compared = misfit(pose.apply(points_m), surface, camera)
        if compared is None:
            return None
        distances.append(np.abs(compared.residual_m))
        rest = surface.rest_xy_m[compared.vertices]
        places.append(np.einsum("nk,nkd->nd", compared.weights, rest))
    return np.concatenate(distances), np.concatenate(places)


def _quietest_m(rival: Rival, keyframes: Sequence[Keyframe], camera: Camera) -> float:
    """Mean distance in the frame that is predicted best: at most that is noise."""
    means = [np.inf]
    for frame, surface, pose in zip(keyframes, rival.surfaces, rival.moved, strict=True):
        compared = misfit(pose.apply(frame.cloud_m), surface, camera)
        if compared is not None:
            means.append(compared.mean_m)
    return float(min(means))


def _attachments(
    why: str, before_m: float = float("nan"), explained: Mapping[MismatchCause, float] | None = None
) -> MismatchFinding:
    return MismatchFinding("attachments", why, before_m=before_m, explained=explained or {})
