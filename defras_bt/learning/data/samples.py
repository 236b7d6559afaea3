"""Samples: at which keyframe of a walk somebody asks for the attachments, and what he has then."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.learning.data.episode import BeliefWalk
from defras_bt.learning.data.shards import RecordedGrasp, RecordedPatient, Shard
from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.prediction import Predicted
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

SAMPLES_PER_WALK = 2.5
_FRAMES = 5
_WARNED_M = 0.002
_FIRST = 2


@dataclass(frozen=True)
class Sample:
    """What an estimator is given, and the truth. ``key`` is unique in the data.

    ``belief`` is the scene as believed; ``predicted`` says what its twin did at the keyframes.
    """

    key: str
    belief: Scene
    keyframes: Sequence[Keyframe]
    predicted: Predicted
    truth: Scene
    cause: str
    kind: str
    local_m: float


def samples_of(shard: Shard) -> Iterator[Sample]:
    """All samples of a shard, in an order that depends on nothing else."""
    for number, (patient, grasp, walk) in enumerate(shard.walks()):
        rng = np.random.default_rng([shard.number, number])
        for last in _asked_at(walk, rng):
            yield _sample(shard, patient, grasp, walk, last, f"{shard.number:05}/{number}/{last}")


def _asked_at(walk: BeliefWalk, rng: np.random.Generator) -> list[int]:
    """Keyframes: the first that warns, as operations ask then, and up to two others after it."""
    frames = np.arange(_FIRST, len(walk.local_m))
    warned = frames[walk.local_m[frames] > _WARNED_M]
    if len(warned) == 0:
        return [int(rng.choice(frames))]
    later = frames[frames > warned[0]]
    more = rng.choice(later, size=min(2, len(later)), replace=False)
    return sorted({int(warned[0]), *more.tolist()})


def _sample(
    shard: Shard,
    patient: RecordedPatient,
    grasp: RecordedGrasp,
    walk: BeliefWalk,
    last: int,
    key: str,
) -> Sample:
    """With at most five keyframes, spread over the motion, the newest among them."""
    kept = np.unique(np.rint(np.linspace(0, last, min(_FRAMES, last + 1))).astype(int))
    taken = {arm: Pose(way[0], POINTING_DOWN) for arm, way in grasp.ways_m.items()}
    keyframes = [
        Keyframe(
            float(frame),
            taken,
            {arm: Pose(way[frame], POINTING_DOWN) for arm, way in grasp.ways_m.items()},
            grasp.clouds_m[frame],
        )
        for frame in kept
    ]
    rest = shard.rest
    surfaces = tuple(
        Surface(walk.vertices_m[frame], rest.triangles, rest.upper, rest.rest_xy_m)
        for frame in kept
    )
    forces = tuple(walk.hole_forces_n[frame] for frame in kept)
    return Sample(
        key=key,
        belief=patient.scene.with_attached(walk.attached),
        keyframes=keyframes,
        predicted=Predicted(rest, surfaces, forces),
        truth=patient.scene,
        cause=patient.cause,
        kind=walk.kind,
        local_m=float(walk.local_m[last]),
    )
