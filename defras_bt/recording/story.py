"""A run in sentences."""

from __future__ import annotations

import math

from defras_bt.planning.english import action_sentence
from defras_bt.planning.plan import Plan
from defras_bt.recording.record import RunSummary

_OUTCOMES = {
    "goal": "Goal reached",
    "not_reached": "Goal not reached",
    "human": "A human was asked for",
    "error": "Stopped by an error",
}


def outcome_title(outcome: str) -> str:
    """The outcome in a few words."""
    if outcome not in _OUTCOMES:
        raise ValueError(f"outcome {outcome!r} is unknown; valid: {', '.join(_OUTCOMES)}")
    return _OUTCOMES[outcome]


def outcome_sentence(summary: RunSummary) -> str:
    """Like ``Goal reached: 94 % of the region is visible after 9 actions.``"""
    values = summary.values
    seen = values["roi_visibility"]
    visible = (
        "the region's visibility is unknown"
        if seen is None
        else f"{percent(seen)} of the region is visible"
    )
    count = values["actions"]
    return (
        f"{outcome_title(values['outcome'])}: {visible} after "
        f"{count} {'action' if count == 1 else 'actions'}."
    )


def percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def times(count: int) -> str:
    """``never``, ``once``, ``twice``, ``3 times``."""
    return ("never", "once", "twice")[count] if count < 3 else f"{count} times"


def newton(force_n: float | None) -> str:
    return "unknown" if force_n is None or math.isnan(force_n) else f"{force_n:.2f} N"


def plan_markdown(plan: Plan | None, step: int) -> str:
    """Numbered sentences; done ones are ticked, the one carried out is bold."""
    if plan is None:
        return "No plan yet."
    origin = "pre-operative" if plan.source == "preoperative" else "made during the operation"
    proof = ", proved shortest" if plan.proved_shortest else ""
    lines = [f"### Plan ({origin}{proof})", ""]
    for index, action in enumerate(plan.actions):
        sentence = f"{action_sentence(action)}."
        if index < step:
            sentence = f"{sentence} ✓"
        elif index == step:
            sentence = f"**{sentence}**"
        lines.append(f"{index + 1}. {sentence}")
    return "\n".join(lines)
