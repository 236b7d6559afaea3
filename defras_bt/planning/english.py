"""Plans and obstacles as English sentences."""

from __future__ import annotations

from collections.abc import Sequence

from clingo import Symbol

from defras_bt.planning.plan import Action, GridPoint, Plan

_SENTENCES = {
    "reach": "{arm} reaches grasp point {point}",
    "open": "{arm} opens its jaw at {point}",
    "grasp": "{arm} grasps the tissue at {point}",
    "pull": "{arm} pulls the tissue up, held at {point}",
    "move": "{arm} moves the tissue towards the region of interest, held at {point}",
    "fold": "{arm} folds the tissue away from the endoscope, held at {point}",
    "release": "{arm} releases the tissue at {point}",
}

_REASONS = {
    "point_is_blocked": "{point} is blocked and cannot expose the region",
    "other_point_exposes": "another point exposes the region in fewer actions or is required",
    "start_over": "the manoeuvres still missing cannot follow those already done",
    "required_point": "the plan was asked to use {point}",
    "best_point": "{point} is the best grasp point of all plans this short{distances}",
    "grasp_needs_open_jaw": "a closed jaw cannot grasp",
    "only_held_tissue_moves": "only held tissue can be moved",
    "exposes": "the region counts as exposed only after it",
    "lifts_first": "held tissue is lifted before anything else is done with it",
}


def point_text(point: GridPoint | None) -> str:
    return "no point" if point is None else f"({point[0]},{point[1]})"


def action_sentence(action: Action) -> str:
    """Like ``PSM1 reaches grasp point (4,2)``."""
    return _SENTENCES[action.name].format(arm=action.arm.upper(), point=point_text(action.point))


def reason_sentence(
    reason: str, point: GridPoint, roi_mm: int | None = None, attachment_mm: int | None = None
) -> str:
    """The wording of a reason of asp/explain.lp."""
    if reason not in _REASONS:
        raise ValueError(f"asp/explain.lp gives reason {reason!r}; worded are {sorted(_REASONS)}")
    parts = []
    if attachment_mm is not None:
        parts.append(f"{attachment_mm} mm from the nearest believed attachment")
    if roi_mm is not None:
        parts.append(f"{roi_mm} mm from the region of interest")
    distances = f": {', '.join(parts)}" if parts else ""
    return _REASONS[reason].format(point=point_text(point), distances=distances)


def plan_text(plan: Plan, *, reasons: bool = False) -> str:
    """Numbered sentences, one a line; with ``reasons``, each says why."""
    if not plan.actions:
        return "Nothing to do: the region counts as exposed already."
    lines = []
    for i, action in enumerate(plan.actions):
        why = f", because {plan.reasons[i]}" if reasons and plan.reasons else ""
        lines.append(f"{action.time}. {action_sentence(action)}{why}.")
    return "\n".join(lines)


def obstacle_sentences(facts: Sequence[Symbol], grid_size: int) -> tuple[str, ...]:
    """What the external atoms that rule out a plan say, blocked points taken together.

    ``grid_size``: number of grasp points of the scene.
    """
    sentences = []
    blocked = sorted(point_of(fact.arguments[0]) for fact in facts if fact.name == "blocked")
    exposing = [fact.arguments[0].name for fact in facts if fact.name == "exposing"]
    if len(blocked) == grid_size:
        sentences.append(f"all {grid_size} grasp points are blocked")
    elif blocked:
        named = ", ".join(point_text(point) for point in blocked[:8])
        more = f" and {len(blocked) - 8} more" if len(blocked) > 8 else ""
        points, are = ("points", "are") if len(blocked) > 1 else ("point", "is")
        sentences.append(f"grasp {points} {named}{more} {are} blocked")
    if exposing:
        sentences.append(f"the region counts as exposed only after {' and '.join(exposing)}")
    for fact in facts:
        if fact.name == "required":
            point = point_text(point_of(fact.arguments[0]))
            sentences.append(f"the plan must use grasp point {point}")
        elif fact.name == "sensed":
            sentences.append(_sensed_sentence(fact.arguments[0]))
    return tuple(sentences)


def _sensed_sentence(fluent: Symbol) -> str:
    arm = fluent.arguments[0].name.upper()
    if fluent.name == "at":
        return f"{arm} is at {point_text(point_of(fluent.arguments[1]))}"
    if fluent.name == "holding":
        return f"{arm} holds the tissue at {point_text(point_of(fluent.arguments[1]))}"
    if fluent.name == "jaw_open":
        return f"{arm} has its jaw open"
    return f"{arm} has done {fluent.arguments[1].name} since it grasped"


def point_of(symbol: Symbol) -> GridPoint:
    return (symbol.arguments[0].number, symbol.arguments[1].number)
