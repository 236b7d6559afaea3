"""Action leaves made from a plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from defras_bt.acting.arm_action import ActionParameters, ArmAction
from defras_bt.acting.jaw import Grasp, Open, Release
from defras_bt.acting.manoeuvre import Fold, Move, Pull
from defras_bt.acting.reach import Reach
from defras_bt.planning.plan import Action, Plan

if TYPE_CHECKING:
    from defras_bt.executive.context import Context

LEAVES: dict[str, type[ArmAction]] = {
    leaf.spoken: leaf for leaf in (Reach, Open, Grasp, Pull, Move, Fold, Release)
}


def action_leaves(plan: Plan, context: Context) -> list[ArmAction]:
    """One leaf per action, in order, named like "3_grasp_psm1".

    Raises:
        ValueError: an action that no leaf carries out.
    """
    return [_leaf(step, action, context) for step, action in enumerate(plan.actions, 1)]


def leaf_name(step: int, action: str, arm: str) -> str:
    """What the leaf of the ``step``-th action (from 1) of a plan is called."""
    return f"{step}_{action}_{arm}"


def _leaf(step: int, action: Action, context: Context) -> ArmAction:
    if action.name not in LEAVES:
        raise ValueError(f"no leaf carries out {action.name!r}; there are: {', '.join(LEAVES)}")
    parameters = ActionParameters.model_validate({"arm": action.arm, "point": action.point})
    return LEAVES[action.name](leaf_name(step, action.name, action.arm), context, parameters)
