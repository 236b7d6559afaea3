"""Which of the rehearsed retractions is chosen, and what force is too much.

Source: Tagliabue et al. 2022, section on pre-operative planning (F_m = median force of all
executions, epsilon = 2 F_m; of the plans that expose the region within epsilon the three with the
lowest F_max, of these the shortest).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from defras_bt.planning.english import point_text
from defras_bt.planning.execution import Execution
from defras_sim.retraction import arm_for
from defras_sim.scene import Scene

THRESHOLD_OVER_MEDIAN = 2.0
LOWEST_FORCES_KEPT = 3


def threshold_n(scene: Scene, median_n: float) -> float:
    """Epsilon [N]: what the scene states, or twice F_m."""
    return scene.thresholds.force_n or THRESHOLD_OVER_MEDIAN * median_n


def median_force_n(executions: Sequence[Execution]) -> float:
    """F_m [N]: the median of the largest forces."""
    if not executions:
        raise ValueError("no retraction was rehearsed, so there is no force to take the median of")
    return float(np.median([execution.force_max_n for execution in executions]))


def qualified(scene: Scene, executions: Iterable[Execution], median_n: float) -> list[Execution]:
    """Those that the scene's rules allow and that expose the region within the force threshold."""
    limit_n, visibility = threshold_n(scene, median_n), scene.thresholds.roi_visibility
    return [e for e in _within(executions, visibility, limit_n) if not forbidden(scene, e)]


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


def why_none(
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
