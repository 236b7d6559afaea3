"""Ticks of a tree as clingo found them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from clingo import Symbol, SymbolType
from py_trees.common import Status

from defras_bt.executive.proof.facts import STATUSES, Numbered


@dataclass(frozen=True)
class TracedTick:
    """One tick; nodes by path.

    ``before`` and ``after`` hold the status of every node before and after the tick, ``shown`` what
    each ticked node showed when it was its turn, also if it was stopped later in the tick.
    ``world`` says what was known about the world; ``new_plan``: one was put in before the tick.
    """

    world: Mapping[str, str]
    new_plan: bool
    before: Mapping[str, Status]
    shown: Mapping[str, Status]
    after: Mapping[str, Status]


@dataclass(frozen=True)
class Trace:
    """Consecutive ticks, and the leaves that do in the last of them what they should not.

    ``root`` is the tree of the last tick.
    """

    root: Numbered
    ticks: tuple[TracedTick, ...]
    culprits: tuple[str, ...]


def read_trace(copies: Sequence[Numbered], atoms: Iterable[Symbol], claim: str) -> Trace:
    """The ticks that ``atoms`` describe; each tree in ``copies`` is that of one tick."""
    place = {node.number: (t, node) for t, root in enumerate(copies) for node in root.walk()}
    statuses: dict[str, list[dict[str, Status]]] = {
        name: [{} for _ in copies] for name in ("was", "result", "after")
    }
    world: list[dict[str, str]] = [{} for _ in copies]
    new_plan = [False for _ in copies]
    culprits = set()
    for atom in atoms:
        values = atom.arguments
        if atom.name in statuses:
            tick, node = place[values[0].number]
            statuses[atom.name][tick][node.path] = STATUSES[values[1].name]
        elif atom.name == "world":
            world[values[0].number][values[1].name] = _text(values[2])
        elif atom.name == "fill":
            new_plan[place[values[0].number][0]] = True
        elif atom.name == "broken" and values[0].name == claim:
            culprits.add(place[values[1].number][1].path)
    ticks = tuple(
        TracedTick(
            world[t],
            new_plan[t],
            statuses["was"][t],
            statuses["result"][t],
            statuses["after"][t],
        )
        for t in range(len(copies))
    )
    return Trace(copies[-1], ticks, tuple(sorted(culprits)))


def _text(symbol: Symbol) -> str:
    return symbol.string if symbol.type == SymbolType.String else str(symbol)
