"""Why not that grasp point: a counterfactual plan, compared with the plan that was made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.planning.english import point_text
from defras_bt.planning.facts import attachment_distances_mm, roi_distances_mm
from defras_bt.planning.plan import GridPoint, Plan, Situation
from defras_bt.planning.planner import NoPlan, Planner


def why_not(
    planner: Planner,
    situation: Situation,
    attached: NDArray[np.bool_],
    plan: Plan,
    point: GridPoint,
) -> str:
    """One sentence on why ``plan`` does not hold the tissue at ``point``.

    ``plan`` must be the planner's answer to ``situation`` and ``attached`` (holes,), with at least
    one action.
    """
    used = plan.actions[-1].point
    if used is None:
        raise ValueError(f"the plan ends with {plan.actions[-1]}, which concerns no grasp point")
    name = point_text(point)
    if used == point:
        return f"The plan does use {name}."
    try:
        other = planner.plan(situation, attached, required_grasp=point)
    except NoPlan as error:
        return f"{name} cannot be used: {'; '.join(error.obstacles)}."
    longer = len(other.actions) - len(plan.actions)
    if longer > 0:
        actions = "action" if longer == 1 else "actions"
        return f"Using {name} takes {longer} {actions} more than using {point_text(used)}."
    return (
        f"Using {name} takes as many actions, but the optimisation prefers {point_text(used)}: "
        f"{name} is {_distances(planner, attached, point)}, "
        f"{point_text(used)} is {_distances(planner, attached, used)}."
    )


def _distances(planner: Planner, attached: NDArray[np.bool_], point: GridPoint) -> str:
    to_roi = f"{roi_distances_mm(planner.scene)[point]} mm from the region of interest"
    to_attachment = attachment_distances_mm(planner.scene, attached).get(point)
    if to_attachment is None:
        return to_roi
    return f"{to_attachment} mm from the nearest believed attachment and {to_roi}"
