"""What both discrepancy metrics say in retractions with a hidden mismatch, and without one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import joblib
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from defras_bt.benchmark.cases import configurations, shipped
from defras_bt.benchmark.mismatches import KINDS, Mismatch, draw_mismatch
from defras_bt.benchmark.preparations import Preparations
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.rest import calibrate_rest
from defras_bt.monitoring.seen import SeenSurface, seen_surface
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.camera.visibility import roi_visibility
from defras_sim.geometry import Floats, Pose
from defras_sim.motion import manoeuvre_target_m
from defras_sim.retraction import arm_for
from defras_sim.scene import GraspPoint, Scene
from defras_sim.surface import Surface
from defras_sim.twin import Twin
from defras_sim.worlds.kinematic_tool import POINTING_DOWN

METRICS = (LocalMetric(), MedianMetric())
REST_FRAMES = 10


@dataclass(frozen=True)
class MonitorRun:
    """One retraction, frame by frame of the depth camera.

    ``mu_m`` (frames,) per metric with the mismatch, ``null_mu_m`` without it. ``moved_m`` (frames,)
    is how far the mismatch moves that part of the tissue (or of its picture) that it moves most.
    ``null_gap_m`` (frames,) is how far the twin is off, without the mismatch, where it is off most:
    its mesh is not the world's. ``starts`` is the frame at which the mismatch begins.
    """

    number: int
    kind: str
    scene: str
    point: GraspPoint
    frame_s: float
    starts: int
    moved_m: Floats
    null_gap_m: Floats
    mu_m: dict[str, Floats]
    null_mu_m: dict[str, Floats]


@dataclass(frozen=True)
class Retraction:
    """One that the pre-operative search found to expose the region within the force threshold."""

    scene: str
    point: GraspPoint
    manoeuvres: tuple[str, ...]


def retractions(preparations: Preparations) -> list[Retraction]:
    """All that the rehearsals of the 17 configurations found good enough to plan."""
    found = []
    for name in configurations():
        scene = shipped(name)
        prepared = preparations.plans[scene_hash(scene)]
        found += [
            Retraction(name, execution.point, execution.manoeuvres)
            for execution in prepared.executions
            if execution.finished
            and execution.visibility >= scene.thresholds.roi_visibility
            and execution.force_max_n <= prepared.force_threshold_n
        ]
    return found


def monitor_runs(
    known: Sequence[Retraction], force_limit_n: float, count: int, seed: int = 0, jobs: int = 1
) -> Iterator[MonitorRun]:
    """``count`` runs, the kinds in turn; run i depends on ``seed`` and i only."""
    work = joblib.Parallel(n_jobs=jobs, return_as="generator")(
        joblib.delayed(monitor_run)(known, force_limit_n, seed, number) for number in range(count)
    )
    yield from work


def monitor_run(
    known: Sequence[Retraction], force_limit_n: float, seed: int, number: int
) -> MonitorRun:
    """Draw a retraction and a mismatch; retract with and without the mismatch.

    A run ends where the region is exposed as believed, and where the believed force reaches its
    threshold, as the executive ends it.
    """
    rng = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)]
    while True:
        retraction = known[int(rng.integers(len(known)))]
        scene = shipped(retraction.scene)
        way_m = _way(scene, retraction.point, retraction.manoeuvres)
        mismatch = draw_mismatch(kind, scene, retraction.point, len(way_m), rng)
        if mismatch is None:
            continue
        run = _retract(number, scene, retraction.point, way_m, force_limit_n, mismatch, rng)
        # What starts as the run ends cannot be noticed by anybody.
        if run is not None and len(run.moved_m) > mismatch.starts + 5:
            return run


def _way(scene: Scene, point: GraspPoint, manoeuvres: Sequence[str]) -> Floats:
    """Tip positions (frames, 3) of a retraction, a camera period apart."""
    step_m = scene.motion.tissue_speed_m_s * scene.depth_camera.period_s
    places = [scene.grasp_point_m(*point)]
    for manoeuvre in manoeuvres:
        goal_m = manoeuvre_target_m(scene, manoeuvre, places[-1])
        count = max(1, round(float(np.linalg.norm(goal_m - places[-1])) / step_m))
        start_m = places[-1]
        places += [start_m + (goal_m - start_m) * (i / count) for i in range(1, count + 1)]
    return np.array(places)


def _retract(
    number: int,
    scene: Scene,
    point: GraspPoint,
    way_m: Floats,
    force_limit_n: float,
    mismatch: Mismatch,
    rng: np.random.Generator,
) -> MonitorRun | None:
    arm = arm_for(scene, point)
    twin, plain, world = (
        Twin(scene),
        Twin(scene.simulated),
        Twin(mismatch.actual(scene).simulated),
    )
    rest = [_measured(scene, plain.state.surface, twin.state.surface, rng)]
    rest += [
        _measured(scene, plain.state.surface, twin.state.surface, rng)
        for _ in range(REST_FRAMES - 1)
    ]
    calibration = {
        metric.name: calibrate_rest([frame[metric.name] for frame in rest], (0.002, 0.004, 0.006))
        for metric in METRICS
    }
    start = Pose(way_m[0], POINTING_DOWN)
    for tissue in (twin, plain, world):
        tissue.grasp(arm, start)
    moved: list[float] = []
    gaps: list[float] = []
    of_world = SameTissue.of(twin.state.surface, plain.state.surface)
    mu: dict[str, list[float]] = {metric.name: [] for metric in METRICS}
    null: dict[str, list[float]] = {metric.name: [] for metric in METRICS}
    for frame, tip_m in enumerate(way_m):
        tips: dict[str, Pose] = {arm: Pose(tip_m, POINTING_DOWN)}
        mismatch.happen(frame, world)
        time_s = frame * scene.depth_camera.period_s
        states = (
            twin.track(tips, time_s),
            plain.track(tips, time_s),
            world.track(mismatch.tips(frame, tips), time_s),
        )
        if not all(state.converged for state in states) or twin.force_n > force_limit_n:
            break
        believed, right, wrong = (state.surface for state in states)
        seen = seen_surface(believed, scene.depth_camera)
        reported = mismatch.camera(frame)
        apparent_m = reported.apply(wrong.vertices_m) - right.vertices_m
        moved.append(float(np.linalg.norm(apparent_m, axis=1).max()))
        gaps.append(of_world.largest_gap_m(believed, right))
        for surface, pose, into in ((right, Pose(np.zeros(3)), null), (wrong, reported, mu)):
            cloud_m = pose.apply(_cloud(scene, surface, rng))
            for metric in METRICS:
                value_m = metric.measure(cloud_m, seen).value_m
                into[metric.name].append(calibration[metric.name].mu_m(value_m))
        if roi_visibility(scene, RayCaster(believed)) >= scene.thresholds.roi_visibility:
            break
    if not moved:
        return None
    return MonitorRun(
        number,
        mismatch.kind,
        scene.name,
        point,
        scene.depth_camera.period_s,
        mismatch.starts,
        np.array(moved),
        np.array(gaps),
        {name: np.array(values) for name, values in mu.items()},
        {name: np.array(values) for name, values in null.items()},
    )


@dataclass(frozen=True)
class SameTissue:
    """Where the upper vertices of one surface lie on another of the same tissue.

    ``upper`` (m,) are those vertices; each is ``weights`` (m, 3) of the vertices ``corners`` (m, 3)
    of the other surface.
    """

    upper: NDArray[np.int64]
    corners: NDArray[np.int64]
    weights: Floats

    @staticmethod
    def of(other: Surface, surface: Surface) -> SameTissue:
        theirs = np.flatnonzero(other.upper)
        upper = np.flatnonzero(surface.upper)
        mesh = Delaunay(other.rest_xy_m[theirs])
        # Rims of both surfaces coincide up to rounding.
        inside_m = surface.rest_xy_m[upper] * (1 - 1e-9)
        simplex = mesh.find_simplex(inside_m)
        affine = mesh.transform[simplex]
        first = np.einsum("mij,mj->mi", affine[:, :2], inside_m - affine[:, 2])
        weights = np.concatenate([first, 1 - first.sum(axis=1, keepdims=True)], axis=1)
        return SameTissue(upper, theirs[mesh.simplices[simplex]], weights)

    def largest_gap_m(self, other: Surface, surface: Surface) -> float:
        there = np.einsum("mk,mkj->mj", self.weights, other.vertices_m[self.corners])
        return float(np.linalg.norm(surface.vertices_m[self.upper] - there, axis=1).max())


def _measured(
    scene: Scene, actual: Surface, believed: Surface, rng: np.random.Generator
) -> dict[str, float]:
    seen: SeenSurface = seen_surface(believed, scene.depth_camera)
    cloud_m = _cloud(scene, actual, rng)
    return {metric.name: metric.measure(cloud_m, seen).value_m for metric in METRICS}


def _cloud(scene: Scene, surface: Surface, rng: np.random.Generator) -> Floats:
    return depth_cloud_m(scene.depth_camera, surface, RayCaster(surface), rng)
