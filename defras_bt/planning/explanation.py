"""Why not otherwise: a counterfactual plan, compared with the plan that was made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.planning.choice import forbidden
from defras_bt.planning.english import plan_text, point_text
from defras_bt.planning.facts import attachment_distances_mm, roi_distances_mm
from defras_bt.planning.plan import ArmSituation, GridPoint, Plan, Situation
from defras_bt.planning.planner import NoPlan, Planner
from defras_bt.planning.preoperative import PreoperativeResult
from defras_sim.advice import Matter
from defras_sim.scene import Scene


def why_not(
    scene: Scene,
    situation: Situation,
    attached: NDArray[np.bool_],
    plan: Plan,
    asked: Matter,
) -> str:
    """Why ``plan`` has no action as ``asked``: what the best plan that has one would be like.

    ``plan`` must be the planner's answer to ``situation`` and ``attached`` (holes,).
    """
    for action in plan.actions:
        if action.point is not None and asked.covers(action.name, action.arm, action.point):
            return f"The plan does that: step {action.time}."
    words = _words(asked)
    try:
        other = Planner(scene, demanded=asked).plan(situation, attached)
    except NoPlan as error:
        return f"No plan can {words}: {'; '.join(error.obstacles)}."
    longer = len(other.actions) - len(plan.actions)
    if longer > 0:
        actions = "action" if longer == 1 else "actions"
        return f"A plan to {words} takes {longer} {actions} more:\n{plan_text(other)}"
    now, then = _held(plan), _held(other)
    if now is None or then is None or now == then:
        return f"A plan to {words} takes as many actions, but the optimisation prefers this one."
    return (
        f"A plan to {words} takes as many actions, but the optimisation prefers "
        f"{point_text(now)}: {point_text(then)} is {_distances(scene, attached, then)}, "
        f"{point_text(now)} is {_distances(scene, attached, now)}."
    )


def why_not_rehearsed(scene: Scene, result: PreoperativeResult, asked: Matter) -> str:
    """Why the plan made before the operation has no action as ``asked``.

    What the rehearsals showed decides; where nothing such was rehearsed, the planner is asked.
    """
    situation = Situation({name: ArmSituation() for name in scene.arms})
    if result.chosen is None:
        return why_not(scene, situation, scene.attached, result.plan, asked)
    for action in result.plan.actions:
        if action.point is not None and asked.covers(action.name, action.arm, action.point):
            return f"The plan does that: step {action.time}."
    tried = [
        execution
        for execution in result.executions
        for arm in scene.arms_at(*execution.point)[:1]
        if any(
            asked.covers(name, arm, execution.point)
            for name in ("reach", "open", "grasp", *execution.manoeuvres)
        )
    ]
    if not tried:
        return why_not(scene, situation, scene.attached, result.plan, asked)
    best = max(tried, key=lambda e: (e.visibility, -e.force_max_n))
    told = (
        f"Of {len(tried)} rehearsed retractions that {_words(asked)}, the best shows "
        f"{best.visibility:.0%} of the region with at most {best.force_max_n:.2f} N"
    )
    rules = [r.sentence() for r in scene.advice if r.kind == "forbid" and forbidden(scene, best)]
    if rules:
        return f"{told}; not allowed: {'; '.join(rules)}."
    if best.visibility < scene.thresholds.roi_visibility:
        return f"{told}; the goal is {scene.thresholds.roi_visibility:.0%}."
    gentlest = min(
        (e for e in tried if e.visibility >= scene.thresholds.roi_visibility),
        key=lambda e: e.force_max_n,
    )
    if gentlest.force_max_n > result.force_threshold_n:
        return f"{told}; the threshold is {result.force_threshold_n:.2f} N."
    return (
        f"{told}, the gentlest such needs {gentlest.force_max_n:.2f} N. The plan needs "
        f"{result.chosen.force_max_n:.2f} N in {len(result.plan.actions)} actions: it is the "
        "shortest of the three gentlest that reach the goal."
    )


def _words(asked: Matter) -> str:
    parts = [asked.action or "act"]
    if asked.arm is not None:
        parts.append(f"with {asked.arm.upper()}")
    if asked.point is not None:
        parts.append(f"at {point_text(asked.point)}")
    return " ".join(parts)


def _held(plan: Plan) -> GridPoint | None:
    return plan.actions[-1].point if plan.actions else None


def _distances(scene: Scene, attached: NDArray[np.bool_], point: GridPoint) -> str:
    to_roi = f"{roi_distances_mm(scene)[point]} mm from the region of interest"
    to_attachment = attachment_distances_mm(scene, attached).get(point)
    if to_attachment is None:
        return to_roi
    return f"{to_attachment} mm from the nearest believed attachment and {to_roi}"
