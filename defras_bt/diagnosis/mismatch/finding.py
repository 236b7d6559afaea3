"""What a quick look at a mismatch finds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, get_args

import numpy as np

from defras_bt.learning.estimate import AttachmentEstimator, Keyframe
from defras_sim.geometry import Pose
from defras_sim.scene import Scene

MismatchCause = Literal["attachments", "grasp", "camera", "arm", "unclear"]
"""``grasp``: the tissue slipped in the jaw. ``arm``: a tip is not where it is told to be.
``unclear``: what was seen so far fits several."""

CAUSES: tuple[MismatchCause, ...] = get_args(MismatchCause)


@dataclass(frozen=True)
class MismatchFinding:
    """``cause`` explains best what was seen since the grasp.

    ``before_m`` and ``after_m`` are mean distances of points that were not fitted, without and with
    it; NaN where attachments are blamed because nothing else explains enough. ``explained``: share
    of the distance above the camera's noise that each rival of the attachments takes away.
    ``true_from_reported`` moves what the camera reports to where it is, if the camera is to blame.
    """

    cause: MismatchCause
    sentence: str
    before_m: float = float("nan")
    after_m: float = float("nan")
    explained: Mapping[MismatchCause, float] = field(default_factory=dict)
    true_from_reported: Pose | None = None


class MismatchService(Protocol):
    """Anything that says what explains a mismatch best."""

    def explain(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        rng: np.random.Generator,
        estimator: AttachmentEstimator,
    ) -> MismatchFinding:
        """``keyframes`` are those since the grasp, in order of time; there is one at least.

        ``estimator`` says how well attachments could explain it.
        """
