"""The interface of attachment learning, and what it says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene


@dataclass(frozen=True)
class Keyframe:
    """One observed shape with what caused it.

    ``grasp_tips``: per holding arm, tissue_from_tip when its jaw closed; ``tips``: now.
    ``cloud_m`` (n, 3) in the tissue frame.
    """

    stamp_s: float
    grasp_tips: Mapping[str, Pose]
    tips: Mapping[str, Pose]
    cloud_m: Floats


@dataclass(frozen=True)
class AttachmentEstimate:
    """A proposed set of holding holes and whether the data bear it out.

    ``attached`` (holes,) and ``probability`` (holes,). Errors are mean point-to-surface distances
    on points that were not fitted, with the belief held before and with the proposal. ``adopted``
    False leaves the belief as it was; ``reason`` says why in one sentence.
    """

    attached: NDArray[np.bool_]
    probability: Floats
    held_out_before_m: float
    held_out_after_m: float
    adopted: bool
    reason: str


class AttachmentEstimator(Protocol):
    """Anything that infers the attachments from observed shapes."""

    def estimate(
        self, belief: Scene, keyframes: Sequence[Keyframe], rng: np.random.Generator
    ) -> AttachmentEstimate:
        """Infer the attachments; ``belief`` is the scene with the set held true until now."""
