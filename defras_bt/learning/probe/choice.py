"""Which small tug tells most about the attachments: where two explanations would part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from defras_bt.learning.estimate import AttachmentEstimate, Keyframe
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.search import Mask
from defras_bt.monitoring.seen import seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene
from defras_sim.tissue.state import TissueState

_UP = np.array([0.0, 0.0, 1.0])
_DIAGONAL = np.sqrt(0.5)
DIRECTIONS: tuple[Floats, ...] = (
    _UP,
    *(
        np.array([x, y, z])
        for x, y, z in (
            (1.0, 0.0, 0.0),
            (-1.0, 0.0, 0.0),
            (0.0, 1.0, 0.0),
            (0.0, -1.0, 0.0),
            (_DIAGONAL, 0.0, _DIAGONAL),
            (-_DIAGONAL, 0.0, _DIAGONAL),
            (0.0, _DIAGONAL, _DIAGONAL),
            (0.0, -_DIAGONAL, _DIAGONAL),
        )
    ),
)
"""Unit vectors along which what is held may be tugged: never down, towards the bed."""

LEAST_DOUBT = 0.25
"""A hole is in doubt where it is otherwise than believed with such a probability or more."""


@dataclass(frozen=True)
class Tug:
    """Moves the tip of ``arm`` by ``way_m`` (3,). Under two explanations the surface would then be
    ``parts_m`` apart where it differs most (95th percentile of what the camera sees), ``now_m``
    before; and the largest grasp force of any of them ``force_n``."""

    arm: str
    way_m: Floats
    parts_m: float
    now_m: float
    force_n: float


@dataclass(frozen=True)
class ProbeRule:
    """A tug is ``length_m`` long, its force stays below ``force_share`` of the threshold in every
    explanation, and explanations part by ``least_gain_m`` more than they do already."""

    length_m: float = 0.006
    force_share: float = 0.8
    least_gain_m: float = 0.0005


@dataclass(frozen=True)
class ProbeChooser:
    """Tries every tug on the tissue model under every explanation."""

    rule: ProbeRule = field(default_factory=ProbeRule)

    def choose(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        explanations: Sequence[Mask],
        force_threshold_n: float,
    ) -> Tug | None:
        """The tug after the last keyframe that parts ``explanations`` (each (holes,)) most.

        None where the model cannot follow one of them, or no tug is safe and tells anything.
        """
        shapes: list[list[TissueState | None]] = []
        now: list[TissueState] = []
        last = len(keyframes) - 1
        arms = sorted(keyframes[-1].tips)
        ways = [(arm, self.rule.length_m * way) for arm in arms for way in DIRECTIONS]
        try:
            replay = Replay(belief, keyframes)
            for explanation in explanations:
                states = replay.repeat(belief.hole_stiffness_n_per_m(explanation))
                now.append(states[-1])
                shapes.append([replay.displaced(last, {arm: way}) for arm, way in ways])
        except NotRepeatable:
            return None
        camera = belief.depth_camera
        now_m = parting_m(now, camera)
        best: Tug | None = None
        for number, (arm, way_m) in enumerate(ways):
            then = [each[number] for each in shapes]
            known = [state for state in then if state is not None]
            if len(known) < len(then):
                continue
            force_n = max(_force_n(state) for state in known)
            if not force_n <= self.rule.force_share * force_threshold_n:
                continue
            parts_m = parting_m(known, camera)
            if parts_m >= now_m + self.rule.least_gain_m and (
                best is None or parts_m > best.parts_m
            ):
                best = Tug(arm, way_m, parts_m, now_m, force_n)
        return best


def explanations_of(
    belief: Scene,
    estimate: AttachmentEstimate,
    *,
    least: float = LEAST_DOUBT,
    most: int = 3,
) -> list[Mask]:
    """The belief, and sets that the data hold for possible too; alone where nothing is doubtful.

    The others change the connected patches of holes that are otherwise than believed with a
    probability of ``least`` or more: all of them, and only the most probable half.
    """
    believed = belief.attached
    otherwise = _otherwise(belief, estimate)
    doubtful = otherwise >= least
    found: list[Mask] = [believed]
    if not doubtful.any():
        return found
    middle = float(np.median(otherwise[doubtful]))
    for changed in (doubtful, doubtful & (otherwise > middle)):
        candidate: Mask = believed ^ changed
        if not any(np.array_equal(candidate, each) for each in found):
            found.append(candidate)
    return found[:most]


def doubtful_holes(
    belief: Scene, estimate: AttachmentEstimate, *, least: float = LEAST_DOUBT
) -> Mask:
    """Holes (holes,) that are otherwise than believed with a probability of ``least`` or more."""
    return _otherwise(belief, estimate) >= least


def _otherwise(belief: Scene, estimate: AttachmentEstimate) -> Floats:
    """Probability (holes,) that a hole is otherwise than believed."""
    said = estimate.probability
    return np.where(belief.attached, 1.0 - said, said) * belief.is_hole


def parting_m(states: Sequence[TissueState], camera: Camera) -> float:
    """How far shapes are apart where they differ most: the largest, over all pairs, of the 95th
    percentile over what the camera sees of either."""
    largest = 0.0
    for i, one in enumerate(states):
        for other in states[i + 1 :]:
            seen = np.unique(
                np.concatenate(
                    [
                        each.surface.triangles[seen_surface(each.surface, camera).triangles].ravel()
                        for each in (one, other)
                    ]
                )
            )
            if len(seen) == 0:
                continue
            apart = np.linalg.norm(
                one.surface.vertices_m[seen] - other.surface.vertices_m[seen], axis=1
            )
            largest = max(largest, float(np.percentile(apart, 95)))
    return largest


def _force_n(state: TissueState) -> float:
    return max(float(np.linalg.norm(force)) for force in state.grasp_forces_n.values())
