"""Effects of the tissue that derivatives do not tell enough of, led along in full.

Some have no derivative where they begin. Of others it says little: a soft spring under tissue that
is lifted far pulls ever more, a firm one holds it. Those are tried at a strength of their own, at
the places where their derivatives explain most of the residual.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from defras_bt.diagnosis.problem import Candidate, Tangent
from defras_bt.diagnosis.twins.tissue_beginnings import (
    ONSET,
    PLACES_TRIED,
    PROMISING,
    STRONG,
    inwards,
    is_there,
    standing,
)
from defras_bt.diagnosis.twins.tissue_gains import Gains
from defras_bt.diagnosis.twins.tissue_part import TissuePart, with_values
from defras_bt.diagnosis.twins.tissue_pass import KeyShape, PassJob
from defras_bt.diagnosis.twins.tissue_passes import run_passes
from defras_sim.effects.effect import Effect, Extension
from defras_sim.known_way import KnownWay
from defras_sim.scene import Scene

_PLACE = ("x_m", "y_m")


@dataclass(frozen=True)
class Wanted:
    """A candidate by ``key`` to be led along ``step`` farther than ``at``, by parameter."""

    key: str
    at: Mapping[str, float]
    step: Mapping[str, float]


@dataclass(frozen=True)
class Repeat:
    """Keyframes of every trajectory, by a model with what is ``wanted``."""

    wanted: Wanted
    shapes: Sequence[Sequence[KeyShape | None]]


def wanted_of(
    candidate: Candidate,
    model: Extension,
    known: Sequence[Tangent],
    gains: Gains,
) -> Iterator[Wanted]:
    """In which ways ``candidate``, an effect of the tissue, should be led along beside ``model``.

    ``known``: its beginnings that have derivatives.
    """
    (p, *_) = [p for p in candidate.free if p.strength]
    if not known:
        at = standing(model, candidate)
        yield Wanted(candidate.key, at, {p.name: inwards(p, at[p.name])})
    elif candidate.effect.name in STRONG and not is_there(model, candidate):
        step = {p.name: STRONG[candidate.effect.name] - p.null}
        onset = ONSET.get(candidate.effect.name)
        places: list[Mapping[str, float]] = []
        placed = any(p.name in _PLACE for p in candidate.free)
        for tangent in gains.best(known, PROMISING if placed else -1.0):
            # What begins at one time is what was there from the start, cut off before that time.
            at = dict(tangent.at) if onset is None else {**tangent.at, onset: 0.0}
            if at not in places and len(places) < PLACES_TRIED:
                places.append(at)
                yield Wanted(candidate.key, at, step)


def repeats(
    scene: Scene,
    model: Extension,
    parts: Sequence[TissuePart],
    candidates: Sequence[Candidate],
    wanted: Sequence[Wanted],
    ways: Sequence[KnownWay | None],
    jobs: int,
) -> list[Repeat]:
    """Models with what is ``wanted`` of ``candidates``, led along on ``jobs`` processes. ``ways``:
    that of a similar model in every part, where it is known."""
    effect = {candidate.key: candidate.effect for candidate in candidates}
    work = [
        PassJob(
            scene,
            with_values(model, effect[one.key].name, _there(one)),
            part.trajectory,
            part.keyframes.chosen,
            way,
            derivatives=False,
        )
        for one in wanted
        for part, way in zip(parts, ways, strict=True)
    ]
    known: dict[str, Effect] = {each.name: each for each in effect.values()}
    found = run_passes(work, known, jobs)
    count = len(parts)
    return [
        Repeat(one, found[count * number : count * (number + 1)])
        for number, one in enumerate(wanted)
    ]


def _there(wanted: Wanted) -> dict[str, float]:
    moved = {name: wanted.at[name] + change for name, change in wanted.step.items()}
    return {**wanted.at, **moved}
