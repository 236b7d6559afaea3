"""The plan made before the operation: every retraction is rehearsed in simulation first.

Source of the selection rule and of the force threshold: Tagliabue et al. 2022, section on
pre-operative planning (F_m = median force of all executions, epsilon = 2 F_m; of the plans that
expose the region within epsilon the three with the lowest F_max, of these the shortest).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed, parallel_config

from defras_bt.planning.english import point_text
from defras_bt.planning.plan import ArmSituation, GridPoint, Plan, Situation
from defras_bt.planning.planner import Planner
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.retraction import SEQUENCES, Rehearser
from defras_sim.scene import Scene

Progress = Callable[[int, int], None]
"""Called with (grasp points rehearsed, of how many), always in the same order."""

STEP_M = 0.004
THRESHOLD_OVER_MEDIAN = 2.0
LOWEST_FORCES_KEPT = 3


@dataclass(frozen=True)
class Execution:
    """One rehearsed retraction, which ends where the region is exposed, as a real one does.

    ``manoeuvres`` are those begun. ``visibility`` (0..1) is the best seen. ``finished`` is False
    where the tissue model could not follow the motion to its end.
    """

    point: GridPoint
    manoeuvres: tuple[str, ...]
    visibility: float
    force_max_n: float
    finished: bool


class NothingToRetract(ValueError):
    """The scene's region needs no retraction, so there is none to plan."""


@dataclass(frozen=True)
class PreoperativeResult:
    """What the rehearsals say. ``chosen`` is None where none qualified; ``reason`` says why."""

    scene: str
    scene_hash: str
    executions: tuple[Execution, ...]
    force_median_n: float
    force_threshold_n: float
    chosen: Execution | None
    plan: Plan
    reason: str


def preoperative_plan(
    scene: Scene, *, jobs: int = 2, progress: Progress | None = None, step_m: float = STEP_M
) -> PreoperativeResult:
    """Rehearse all retractions of ``scene``, choose one, and plan it.

    Without a retraction that qualifies, the plan is the one that the ASP optimisation prefers.

    Raises:
        NoPlan: no arm can reach any grasp point.
        NothingToRetract: the region is visible as things are.
    """
    executions = rehearse_all(scene, jobs=jobs, progress=progress, step_m=step_m)
    if executions and not any(execution.manoeuvres for execution in executions):
        raise NothingToRetract(
            f"scene {scene.name!r}: {executions[0].visibility:.0%} of the region is visible before "
            "anything is moved; put the region deeper under the tissue"
        )
    median_n = median_force_n(executions)
    limit_n = scene.thresholds.force_n or THRESHOLD_OVER_MEDIAN * median_n
    chosen = choose(executions, scene.thresholds.roi_visibility, limit_n)
    planner, situation = Planner(scene), Situation({name: ArmSituation() for name in scene.arms})
    if chosen is None:
        plan = planner.plan(situation, scene.attached)
        reason = _why_none(executions, scene.thresholds.roi_visibility, limit_n)
    else:
        plan = planner.plan(
            situation,
            scene.attached,
            required_grasp=chosen.point,
            exposing=chosen.manoeuvres,
        )
        plan = replace(plan, source="preoperative")
        reason = (
            f"grasping {point_text(chosen.point)} and {' and '.join(chosen.manoeuvres)} shows "
            f"{chosen.visibility:.0%} of the region with at most {chosen.force_max_n:.2f} N, "
            f"threshold {limit_n:.2f} N"
        )
    return PreoperativeResult(
        scene=scene.name,
        scene_hash=scene_hash(scene),
        executions=executions,
        force_median_n=median_n,
        force_threshold_n=limit_n,
        chosen=chosen,
        plan=plan,
        reason=reason,
    )


def force_threshold_over(
    scenes: Sequence[Scene],
    *,
    jobs: int = 2,
    progress: Progress | None = None,
    step_m: float = STEP_M,
) -> float:
    """Epsilon [N] from all executions of all ``scenes`` together, as the paper derives it."""
    executions: list[Execution] = []
    total = sum(len(_reachable_points(scene)) for scene in scenes)
    before = 0
    for scene in scenes:

        def report(done: int, _: int, before: int = before) -> None:
            if progress is not None:
                progress(before + done, total)

        executions += rehearse_all(scene, jobs=jobs, progress=report, step_m=step_m)
        before += len(_reachable_points(scene))
    return THRESHOLD_OVER_MEDIAN * median_force_n(executions)


def rehearse_all(
    scene: Scene, *, jobs: int = 2, progress: Progress | None = None, step_m: float = STEP_M
) -> tuple[Execution, ...]:
    """Every reachable grasp point with every sequence of manoeuvres, in a fixed order.

    A sequence that exposes the region before its last manoeuvre equals a shorter one and is listed
    once.
    """
    points = _reachable_points(scene)
    executions: list[Execution] = []
    with parallel_config(backend="loky", inner_max_num_threads=1):
        tasks = (delayed(_rehearse_point)(scene, point, step_m) for point in points)
        results = Parallel(n_jobs=jobs, return_as="generator")(tasks)
        for done, of_point in enumerate(results, start=1):
            executions += of_point
            if progress is not None:
                progress(done, len(points))
    return tuple(executions)


def choose(executions: Iterable[Execution], visibility: float, limit_n: float) -> Execution | None:
    """Of the three gentlest that expose within the force limit the shortest, else the gentler."""
    qualified = [e for e in executions if e.visibility >= visibility and e.force_max_n <= limit_n]
    gentlest = sorted(qualified, key=lambda e: (e.force_max_n, e.point))[:LOWEST_FORCES_KEPT]
    return min(gentlest, key=lambda e: (len(e.manoeuvres), e.force_max_n), default=None)


def median_force_n(executions: Sequence[Execution]) -> float:
    """F_m [N]: the median of the largest forces."""
    if not executions:
        raise ValueError("no retraction was rehearsed, so there is no force to take the median of")
    return float(np.median([execution.force_max_n for execution in executions]))


def _rehearse_point(scene: Scene, point: GridPoint, step_m: float) -> list[Execution]:
    rehearser = Rehearser(scene, step_m=step_m, stop_when_exposed=True)
    found: dict[tuple[str, ...], Execution] = {}
    for sequence in SEQUENCES:
        rehearsal = rehearser.run(point, sequence)
        found[rehearsal.manoeuvres] = Execution(
            point=point,
            manoeuvres=rehearsal.manoeuvres,
            visibility=rehearsal.best_visibility,
            force_max_n=rehearsal.force_max_n,
            finished=rehearsal.finished,
        )
    return list(found.values())


def _reachable_points(scene: Scene) -> tuple[GridPoint, ...]:
    return tuple(point for point in scene.grasp_points if scene.arms_at(*point))


def _why_none(executions: Sequence[Execution], visibility: float, limit_n: float) -> str:
    exposing = [e for e in executions if e.visibility >= visibility]
    if exposing:
        force_n = min(e.force_max_n for e in exposing)
        why = (
            f"the gentlest of the {len(exposing)} rehearsed retractions that expose the region "
            f"needs {force_n:.2f} N, more than the threshold of {limit_n:.2f} N"
        )
    else:
        best = max(executions, key=lambda e: e.visibility)
        why = (
            f"none of the {len(executions)} rehearsed retractions shows {visibility:.0%} of the "
            f"region; the best, at {point_text(best.point)}, shows {best.visibility:.0%}"
        )
    return f"{why}; the plan is the one that the grasp-point optimisation prefers"
