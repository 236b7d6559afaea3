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
    return f"{outcome_title(summary.values['outcome'])}: {result_sentence(summary)}"


def result_sentence(summary: RunSummary) -> str:
    """Like ``94 % of the region is visible after 9 actions.``"""
    seen, count = summary.values["roi_visibility"], summary.values["actions"]
    share = "an unknown share" if seen is None else percent(seen)
    actions = "action" if count == 1 else "actions"
    return f"{share} of the region is visible after {count} {actions}."


def percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def times(count: int) -> str:
    """``once``, ``twice``, ``3 times``."""
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def newton(force_n: float | None) -> str:
    return "unknown" if force_n is None or math.isnan(force_n) else f"{force_n:.2f} N"


def plan_markdown(plan: Plan | None, step: int | None) -> str:
    """Numbered sentences; while one is carried out it is bold, and those before it are ticked."""
    if plan is None:
        return "No plan yet."
    origin = "pre-operative" if plan.source == "preoperative" else "made during the operation"
    proof = ", proved shortest" if plan.proved_shortest else ""
    lines = [f"### Plan ({origin}{proof})", ""]
    for index, action in enumerate(plan.actions):
        sentence = f"{action_sentence(action)}."
        if step is not None and index < step:
            sentence = f"{sentence} ✓"
        elif index == step:
            sentence = f"**{sentence}**"
        lines.append(f"{index + 1}. {sentence}")
    return "\n".join(lines)
