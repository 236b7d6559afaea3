"""The plan made before the operation: every retraction is rehearsed in simulation first.

How one is chosen: :mod:`defras_bt.planning.choice`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_bt.planning.choice import (
    choose,
    forbidden,
    median_force_n,
    qualified,
    threshold_n,
    why_none,
)
from defras_bt.planning.engine import Engine
from defras_bt.planning.english import point_text
from defras_bt.planning.execution import Execution
from defras_bt.planning.journal import Journal
from defras_bt.planning.plan import ArmSituation, Plan, Situation
from defras_bt.planning.planner import Planner
from defras_bt.planning.rehearsals import STEP_M, Progress, reachable_points, rehearse_all
from defras_bt.planning.robust import Robustness, choose_robust, sampled_beliefs
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.scene import Scene


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
        reason = why_none(scene, executions, allowed, limit_n)
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
