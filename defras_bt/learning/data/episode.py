"""One patient, grasped and led along: what was seen, and what the twin says under wrong beliefs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.data.beliefs import draw_belief
from defras_bt.learning.data.causes import (
    CAUSES,
    SHARES,
    Cause,
    Circumstances,
    draw_circumstances,
)
from defras_bt.learning.data.motions import KEYFRAME_S, Hold, draw_hold
from defras_bt.learning.data.sensors import DepthSensor
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.seen import seen_surface
from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera, Scene
from defras_sim.tissue.model import NothingToGrasp
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

_SECOND_ARM_SHARE = 0.12
_TWICE_SHARE = 0.4
_STOPPED_M = 0.006
_FRAMES_PAST = 2
"""A twin that is farther off than this is led on a little: an operation stops there."""
_FEWEST_FRAMES = 3
_FEWEST_POINTS = 50
_RESIDUAL_SHARE = 2e-3
"""Shapes stay within hundredths of a millimetre of those of the twin's own tolerance."""


@dataclass(frozen=True)
class BeliefWalk:
    """The twin under one belief at the first ``m`` keyframes of a grasp.

    ``attached`` (holes,); ``vertices_m`` (m, vertices, 3) of its surface; ``hole_forces_n``
    (m, holes, 3); ``local_m`` (m,): the local discrepancy that monitoring would see.
    """

    kind: str
    attached: NDArray[np.bool_]
    vertices_m: Floats
    hole_forces_n: Floats
    local_m: Floats


@dataclass(frozen=True)
class Grasp:
    """One grasp: ``holds`` by arm, of which the first leads; ``clouds_m`` (n, 3) per keyframe."""

    holds: Sequence[Hold]
    clouds_m: Sequence[Floats]
    walks: Sequence[BeliefWalk]


@dataclass(frozen=True)
class Episode:
    """``patient`` holds the true attachments; ``cause`` says what is not as believed."""

    patient: Scene
    cause: Cause
    grasps: Sequence[Grasp]


class TissueModels:
    """Twin and reality of one tissue, made once and used for all patients that have it."""

    def __init__(self, tissue: Scene) -> None:
        self.twin = ExtendedTissue(tissue, {}, residual_share=_RESIDUAL_SHARE)
        self.rest = self.twin.model.rest_surface
        self._world = ExtendedTissue(tissue.simulated, {}, residual_share=_RESIDUAL_SHARE)

    def world(self, patient: Scene, inclusion: Mapping[str, float] | None) -> ExtendedTissue:
        """The actual tissue of ``patient`` at rest."""
        if inclusion is None:
            return at_rest(self._world, patient, patient.attached)
        extension = {"inclusion": inclusion}
        stiffened = ExtendedTissue(patient.simulated, extension, residual_share=_RESIDUAL_SHARE)
        return at_rest(stiffened, patient, patient.attached)


def at_rest(tissue: ExtendedTissue, patient: Scene, attached: NDArray[np.bool_]) -> ExtendedTissue:
    """``tissue`` with nothing grasped, held by ``attached`` (holes,)."""
    tissue.set_hole_stiffness(patient.hole_stiffness_n_per_m(attached))
    tissue.reset()
    return tissue


def draw_episode(
    models: TissueModels,
    patient: Scene,
    rng: np.random.Generator,
    *,
    beliefs: int = 2,
) -> Episode | None:
    """Grasp ``patient`` once or twice and predict each under ``beliefs`` beliefs.

    None where the model does not follow: too little would be seen.
    """
    cause = CAUSES[rng.choice(len(CAUSES), p=SHARES)]
    done: list[Grasp] = []
    for _ in range(1 + int(rng.random() < _TWICE_SHARE)):
        holds = _draw_holds(patient, rng)
        about = draw_circumstances(cause, patient, holds[0].point, len(holds[0].way_m), rng)
        world = models.world(patient, about.inclusion)
        clouds = _observed(world, patient, about, holds, rng)
        if len(clouds) < _FEWEST_FRAMES:
            continue
        wrong = cause == "attachments"
        walks = []
        for _ in range(beliefs if wrong else 1):
            kind, mask = draw_belief(patient, rng) if wrong else ("equal", patient.attached)
            twin = at_rest(models.twin, patient, mask)
            walk = _walk(twin, patient.depth_camera, kind, mask, holds, clouds)
            if walk is not None:
                walks.append(walk)
        if walks:
            done.append(Grasp(holds, clouds, walks))
    return Episode(patient, cause, done) if done else None


def _draw_holds(patient: Scene, rng: np.random.Generator) -> list[Hold]:
    """One arm, or now and then a second one that holds or moves beside it."""
    first = draw_hold(patient, rng)
    if rng.random() >= _SECOND_ARM_SHARE:
        return [first]
    for _ in range(10):
        second = draw_hold(patient, rng)
        apart = np.linalg.norm(second.way_m[0] - first.way_m[0])
        if second.arm != first.arm and apart > 0.03:
            share = float(rng.uniform(0.0, 0.5))
            way = second.way_m[0] + share * (second.way_m - second.way_m[0])
            frames = np.minimum(np.arange(len(first.way_m)), len(way) - 1)
            return [first, Hold(second.arm, second.point, way[frames])]
    return [first]


def _observed(
    world: ExtendedTissue,
    patient: Scene,
    about: Circumstances,
    holds: Sequence[Hold],
    rng: np.random.Generator,
) -> list[Floats]:
    """Clouds of the keyframes, as far as the actual tissue can be led."""
    camera = DepthSensor.drawn(patient.depth_camera, rng)
    taken = {hold.arm for hold in holds}
    unknown = next((name for name in patient.arms if name not in taken), None)
    intruder: dict[str, Pose] = {}
    if about.second_grasp is not None and unknown is not None:
        intruder = {unknown: Pose(patient.grasp_point_m(*about.second_grasp), POINTING_DOWN)}
    try:
        for hold in holds:
            world.grasp(hold.arm, about.tip(hold.tip(0), 0))
        for arm, tip in intruder.items():
            world.grasp(arm, tip)
    except NothingToGrasp:
        return []
    clouds: list[Floats] = []
    for frame in range(len(holds[0].way_m)):
        tips: dict[str, Pose] = {h.arm: about.tip(h.tip(frame), frame) for h in holds}
        tips |= {arm: tip.moved(frame * about.second_step_m) for arm, tip in intruder.items()}
        state = world.solve(tips, frame * KEYFRAME_S)
        if not state.converged:
            break
        shafts = [
            (hold.way_m[frame], np.array(patient.arms[hold.arm].rcm_m, float)) for hold in holds
        ]
        points = camera.cloud_m(state.surface, np.array(shafts))
        if frame >= about.camera_from:
            points = about.reported.apply(points)
        if len(points) < _FEWEST_POINTS:
            break
        clouds.append(points)
    return clouds


def _walk(
    twin: ExtendedTissue,
    camera: Camera,
    kind: str,
    mask: NDArray[np.bool_],
    holds: Sequence[Hold],
    clouds: Sequence[Floats],
) -> BeliefWalk | None:
    """The twin led along under a belief until it is far off."""
    vertices, forces, local = [], [], []
    metric, past = LocalMetric(), 0
    try:
        for hold in holds:
            twin.grasp(hold.arm, hold.tip(0))
    except NothingToGrasp:
        return None
    for frame, cloud in enumerate(clouds):
        state = twin.solve({hold.arm: hold.tip(frame) for hold in holds}, frame * KEYFRAME_S)
        if not state.converged:
            break
        vertices.append(state.surface.vertices_m)
        forces.append(state.attachment_forces_n)
        local.append(metric.measure(cloud, seen_surface(state.surface, camera)).value_m)
        past += local[-1] > _STOPPED_M
        if past > _FRAMES_PAST and len(local) >= _FEWEST_FRAMES:
            break
    if len(local) < _FEWEST_FRAMES:
        return None
    return BeliefWalk(kind, mask, np.array(vertices), np.array(forces), np.array(local))
