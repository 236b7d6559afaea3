"""What a diagnosis says in the terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.report_words import (
    TITLES,
    estimate_words,
    excluded_words,
    key_words,
    readable,
    share_words,
    spoken,
    verdict_sentence,
)
from defras_bt.diagnosis.verdict import Verdict
from defras_sim.effects.effect import Effect

_STYLES = {"named": "bold green", "set": "bold yellow", "outside": "bold red", "nothing": "bold"}
_MOST_EXCLUDED = 8


def print_diagnosis(console: Console, diagnosis: Diagnosis, effects: Iterable[Effect]) -> None:
    """Print verdict, causes, gain, warnings and what would settle open questions."""
    verdict = diagnosis.verdict
    known = {effect.name: effect for effect in effects}
    console.print(Text(TITLES[verdict.verdict], style=_STYLES[verdict.verdict]))
    console.print(verdict_sentence(verdict, known), markup=False, highlight=False)
    if not diagnosis.complete:
        console.print("Interrupted: this is what had been found until then.", style="yellow")
    if verdict.causes:
        console.print(_causes(verdict))
    if verdict.verdict != "nothing":
        console.print(_gain(verdict), markup=False, highlight=False)
    for warning in verdict.warnings:
        console.print(Text(readable(warning, known), style="yellow"))
    if verdict.excluded:
        told = [excluded_words(key, each) for key, each in verdict.excluded.items()]
        more = len(told) - _MOST_EXCLUDED
        rest = f"; and {more} more" if more > 0 else ""
        console.print(
            f"Would have shown: {'; '.join(told[:_MOST_EXCLUDED])}{rest}.",
            markup=False,
            highlight=False,
        )
    if verdict.proposed_motion:
        console.print(
            f"What would settle it: {verdict.proposed_motion}", markup=False, highlight=False
        )


def _causes(verdict: Verdict) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0))
    for name in ("cause", "number", "value", "removes alone", "cannot be told from"):
        table.add_column(name, style="" if name == "cause" else "dim")
    for cause in verdict.causes:
        name = key_words(f"{cause.effect}@{cause.site}" if cause.site else cause.effect)
        alike = ", ".join(key_words(key) for key in cause.cannot_tell)
        first = (share_words(cause.gain), alike)
        for index, (parameter, estimate) in enumerate(cause.parameters.items()):
            table.add_row(
                name if index == 0 else "",
                spoken(parameter),
                estimate_words(estimate),
                *(first if index == 0 else ("", "")),
            )
        if not cause.parameters:
            table.add_row(name, "", "", *first)
    return table


def _gain(verdict: Verdict) -> str:
    gain = verdict.gain
    told = [
        f"{share_words(share)} {where}"
        for share, where in (
            (gain.in_range, "in the same range"),
            (gain.beyond_range, "beyond it"),
            (gain.new_grasp, "at a new grasp point"),
        )
        if share is not None
    ]
    left = verdict.unexplained_share
    removed = f"Error removed, held out: {', '.join(told)}. " if told else ""
    return f"{removed}Left unexplained: {share_words(left)}."
