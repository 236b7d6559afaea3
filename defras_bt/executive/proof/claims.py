"""What is claimed of every tree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from defras_bt.executive.dangers import WORLD


@dataclass(frozen=True)
class Claim:
    """Something that must hold in every tick.

    ``danger`` is what is known about the world, as (variable, value), and ``forbidden`` what no
    leaf may do then: propose motion, or any command. ``monitored``: only of trees with a metric.
    """

    name: str
    statement: str
    danger: tuple[str, str] | None = None
    forbidden: Literal["motion", "command"] | None = None
    monitored: bool = False


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "guards_first",
        "no motion leaf is ticked unless every guard above it succeeded in the same tick",
    ),
    Claim(
        "stops_with_guard",
        "when a guard fails, no motion leaf is running at the end of that tick, and none of its "
        "commands leaves",
    ),
    Claim(
        "warning_3",
        "warning state 3 leads to a hold within the tick, from every state: nothing is commanded",
        ("warning", "3"),
        "command",
        monitored=True,
    ),
    Claim("warning_2", "under warning state 2 nothing moves", ("warning", "2"), "motion", True),
    Claim(
        "warning_unknown",
        "under an unknown warning state nothing moves",
        ("warning", "unknown"),
        "motion",
        True,
    ),
    Claim(
        "readings_missing",
        "while a reading is missing nothing is commanded",
        ("readings", "missing"),
        "command",
    ),
    Claim(
        "operator_stops",
        "in the tick in which the operator stops nothing is commanded",
        ("operator", "stops"),
        "command",
    ),
    Claim(
        "operator_pauses",
        "while the operator pauses the operation nothing is commanded",
        ("operator", "pauses"),
        "command",
    ),
    Claim(
        "operator_drives",
        "from the operator's taking over to the handing back nothing is commanded",
        ("operator", "drives"),
        "command",
    ),
    Claim(
        "force_dangerous",
        "while the force is unknown, or too high for long, nothing moves",
        ("force", "dangerous"),
        "motion",
    ),
    Claim(
        "well_kept",
        "every tick and every new plan leave the tree in a state that the proof starts from",
    ),
)


def claims_of(monitored: bool) -> tuple[Claim, ...]:
    """The claims that concern a tree with or without monitoring."""
    return tuple(claim for claim in CLAIMS if monitored or not claim.monitored)


def claim_facts(claims: tuple[Claim, ...]) -> Iterator[str]:
    """The claims and the world for asp/tree_proof.lp."""
    for variable, values in WORLD.items():
        yield from (f'value({variable},"{value}").' for value in values)
    for claim in claims:
        yield f"claim({claim.name})."
        if claim.danger is not None:
            variable, value = claim.danger
            yield f'forbids({claim.name},{variable},"{value}",{claim.forbidden}).'
