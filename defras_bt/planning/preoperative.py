"""The plan made before the operation: every retraction is rehearsed in simulation first.

Source of the selection rule and of the force threshold: Tagliabue et al. 2022, section on
pre-operative planning (F_m = median force of all executions, epsilon = 2 F_m; of the plans that
expose the region within epsilon the three with the lowest F_max, of these the shortest).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.planning.engine import Engine
from defras_bt.planning.english import point_text
from defras_bt.planning.execution import Execution
from defras_bt.planning.journal import Journal
from defras_bt.planning.plan import ArmSituation, Plan, Situation
from defras_bt.planning.planner import Planner
from defras_bt.planning.rehearsals import STEP_M, Progress, reachable_points, rehearse_all
from defras_bt.planning.robust import Robustness, choose_robust, sampled_beliefs
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.retraction import arm_for
from defras_sim.scene import Scene

THRESHOLD_OVER_MEDIAN = 2.0
LOWEST_FORCES_KEPT = 3


class NothingToRetract(ValueError):
    """The scene's region needs no retraction, so there is none to plan."""


@dataclass(frozen=True)
class PreoperativeResult:
    """What the rehearsals say. ``chosen`` is None where none qualified; ``reason`` says why.

    ``robustness`` of the chosen one, where sampled sets of attachments were rehearsed too.
    """

    scene: str
    scene_hash: str
    executions: tuple[Execution, ...]
    force_median_n: float
    force_threshold_n: float
    chosen: Execution | None
    plan: Plan
    reason: str
    robustness: Robustness | None = None


def preoperative_plan(
    scene: Scene,
    *,
    engine: Engine | None = None,
    journal: Journal | None = None,
    progress: Progress | None = None,
    step_m: float = STEP_M,
) -> PreoperativeResult:
    """Rehearse all retractions of ``scene``, choose one, and plan it.

    Raises:
        NoPlan: no arm can reach any grasp point.
        NothingToRetract: the region is visible as things are.
    """
    return preoperative_plans(
        [scene], engine=engine, journal=journal, progress=progress, step_m=step_m
    )[0]


def preoperative_plans(
    scenes: Sequence[Scene],
    *,
    engine: Engine | None = None,
    journal: Journal | None = None,
    progress: Progress | None = None,
    step_m: float = STEP_M,
    samples: int = 0,
    rng: np.random.Generator | None = None,
) -> list[PreoperativeResult]:
    """Rehearse all retractions of all ``scenes``; epsilon comes from all of them together.

    Without a retraction that qualifies, a scene's plan is the one that the ASP optimisation
    prefers. A scene that states its own threshold keeps it. With ``samples``, that many sets of
    attachments are drawn around each belief with ``rng``, and the retraction that works in most
    of them is chosen; they do not count for epsilon.

    Raises:
        ValueError: samples without a generator.
        NoPlan: no arm can reach any grasp point.
        NothingToRetract: a region is visible as things are.
    """
    if samples and rng is None:
        raise ValueError("drawing sets of attachments needs a random generator")
    drawn = [sampled_beliefs(scene, samples, rng) if rng else [] for scene in scenes]
    believed = rehearse_all(
        scenes, engine=engine, journal=journal, progress=progress, step_m=step_m
    )
    median_n = median_force_n([execution for of_scene in believed for execution in of_scene])
    # A sampled set can only decide between retractions that work as believed.
    candidates = [
        {e.point for e in qualified(scene, executions, median_n)}
        for scene, executions in zip(scenes, believed, strict=True)
    ]
    before = sum(len(reachable_points(scene)) for scene in scenes)
    others = iter(
        rehearse_all(
            [scene for around in drawn for scene in around],
            engine=engine,
            journal=journal,
            progress=progress and (lambda done, of: progress(before + done, before + of)),
            step_m=step_m,
            only=[some for around, some in zip(drawn, candidates, strict=True) for _ in around],
        )
        if samples
        else ()
    )
    return [
        result_of(scene, executions, median_n, [next(others) for _ in around])
        for scene, executions, around in zip(scenes, believed, drawn, strict=True)
    ]


def qualified(scene: Scene, executions: Iterable[Execution], median_n: float) -> list[Execution]:
    """Those that the scene's rules allow and that expose the region within the force threshold."""
    limit_n, visibility = threshold_n(scene, median_n), scene.thresholds.roi_visibility
    return [e for e in _within(executions, visibility, limit_n) if not forbidden(scene, e)]


def threshold_n(scene: Scene, median_n: float) -> float:
    """Epsilon [N]: what the scene states, or twice F_m."""
    return scene.thresholds.force_n or THRESHOLD_OVER_MEDIAN * median_n


def result_of(
    scene: Scene,
    executions: tuple[Execution, ...],
    median_n: float,
    elsewhere: Sequence[Sequence[Execution]] = (),
) -> PreoperativeResult:
    """What the ``executions`` of ``scene`` say, where ``median_n`` is F_m.

    ``elsewhere``: the executions with each sampled set of attachments.

    Raises:
        NoPlan: no arm can reach any grasp point.
        NothingToRetract: the region is visible as things are.
    """
    if executions and not any(execution.manoeuvres for execution in executions):
        raise NothingToRetract(
            f"scene {scene.name!r}: {executions[0].visibility:.0%} of the region is visible before "
            "anything is moved; put the region deeper under the tissue"
        )
    limit_n = threshold_n(scene, median_n)
    allowed = [execution for execution in executions if not forbidden(scene, execution)]
    robust = None
    if elsewhere:
        found = choose_robust(allowed, elsewhere, scene.thresholds.roi_visibility, limit_n)
        chosen, robust = found or (None, None)
    else:
        chosen = choose(allowed, scene.thresholds.roi_visibility, limit_n)
    planner, situation = Planner(scene), Situation({name: ArmSituation() for name in scene.arms})
    if chosen is None:
        plan = planner.plan(situation, scene.attached)
        reason = _why_none(scene, executions, allowed, limit_n)
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
        if robust is not None:
            reason += f"; {robust.sentence()}"
    return PreoperativeResult(
        scene=scene.name,
        scene_hash=scene_hash(scene),
        executions=executions,
        force_median_n=median_n,
        force_threshold_n=limit_n,
        chosen=chosen,
        plan=plan,
        reason=reason,
        robustness=robust,
    )


def forbidden(scene: Scene, execution: Execution) -> bool:
    """Whether a rule of the scene forbids an action of this retraction."""
    arm = arm_for(scene, execution.point)
    actions = ("reach", "open", "grasp", *execution.manoeuvres)
    return any(
        advice.kind == "forbid" and advice.matter.covers(action, arm, execution.point)
        for advice in scene.advice
        for action in actions
    )


def choose(executions: Iterable[Execution], visibility: float, limit_n: float) -> Execution | None:
    """Of the three gentlest that expose within the force limit the shortest, else the gentler."""
    working = _within(executions, visibility, limit_n)
    gentlest = sorted(working, key=lambda e: (e.force_max_n, e.point))[:LOWEST_FORCES_KEPT]
    return min(gentlest, key=lambda e: (len(e.manoeuvres), e.force_max_n), default=None)


def _within(executions: Iterable[Execution], visibility: float, limit_n: float) -> list[Execution]:
    return [e for e in executions if e.visibility >= visibility and e.force_max_n <= limit_n]


def median_force_n(executions: Sequence[Execution]) -> float:
    """F_m [N]: the median of the largest forces."""
    if not executions:
        raise ValueError("no retraction was rehearsed, so there is no force to take the median of")
    return float(np.median([execution.force_max_n for execution in executions]))


def _why_none(
    scene: Scene, executions: Sequence[Execution], allowed: Sequence[Execution], limit_n: float
) -> str:
    """Why none of the ``executions``, of which the scene's rules leave ``allowed``, was chosen."""
    visibility = scene.thresholds.roi_visibility
    exposing = [e for e in allowed if e.visibility >= visibility]
    ruled_out = len(executions) - len(allowed)
    rules = f" (the scene's rules forbid {ruled_out} others)" if ruled_out else ""
    if not allowed:
        why = f"the scene's rules forbid all {len(executions)} rehearsed retractions"
    elif exposing:
        force_n = min(e.force_max_n for e in exposing)
        why = (
            f"the gentlest of the {len(exposing)} rehearsed retractions that expose the region "
            f"needs {force_n:.2f} N, more than the threshold of {limit_n:.2f} N{rules}"
        )
    else:
        best = max(allowed, key=lambda e: e.visibility)
        why = (
            f"none of the {len(allowed)} rehearsed retractions shows {visibility:.0%} of the "
            f"region; the best, at {point_text(best.point)}, shows {best.visibility:.0%}{rules}"
        )
    return f"{why}; the plan is the one that the grasp-point optimisation prefers"
