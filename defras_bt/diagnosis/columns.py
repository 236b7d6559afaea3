"""Linearised causes: what each candidate would do to the predictions, as columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Linearised, Tangent
from defras_sim.effects.effect import EffectParameter, Extension
from defras_sim.geometry import Floats

_WIDEST = 1e6


@dataclass(frozen=True)
class Option:
    """One tangent or secant of a candidate: predictions change by ``columns @ amplitudes``, where
    each amplitude is between ``lower`` and ``upper`` (k,)."""

    key: str
    tangent: Tangent
    columns: Floats
    lower: Floats
    upper: Floats


@dataclass(frozen=True)
class Sketch:
    """All candidates near one model. ``options`` has a list per candidate key (empty where the
    twin cannot follow it)."""

    candidates: tuple[Candidate, ...]
    options: Mapping[str, tuple[Option, ...]]

    def candidate(self, key: str) -> Candidate:
        return next(c for c in self.candidates if c.key == key)

    def nuisances(self, *without: str) -> tuple[Option, ...]:
        """First options of the nuisances, other than those named."""
        return tuple(
            self.options[c.key][0]
            for c in self.candidates
            if c.nuisance and c.key not in without and self.options[c.key]
        )


def sketch(
    problem: Linearised,
    model: Extension,
    candidates: Sequence[Candidate],
    told: Callable[[str, float], None] | None = None,
) -> Sketch:
    """Tangents of all ``candidates`` at ``model``."""
    options: dict[str, tuple[Option, ...]] = {}
    for number, candidate in enumerate(candidates):
        options[candidate.key] = tuple(
            _option(candidate, tangent) for tangent in problem.tangents(model, candidate)
        )
        if told is not None:
            told(f"what {candidate.key} would change", (number + 1) / len(candidates))
    return Sketch(tuple(candidates), options)


def _option(candidate: Candidate, tangent: Tangent) -> Option:
    columns = np.atleast_2d(np.asarray(tangent.columns, dtype=float).T).T
    if columns.shape[1] != len(tangent.steps):
        raise ValueError(
            f"tangent of {candidate.key}: {columns.shape[1]} columns for {len(tangent.steps)} "
            "steps; there should be one column for each step"
        )
    limits = [_limits(step, tangent.at, candidate.free) for step in tangent.steps]
    return Option(
        candidate.key,
        tangent,
        np.where(np.isfinite(columns), columns, 0.0),
        np.array([lower for lower, _ in limits]),
        np.array([upper for _, upper in limits]),
    )


def _limits(
    step: Mapping[str, float], at: Mapping[str, float], free: Sequence[EffectParameter]
) -> tuple[float, float]:
    """Amplitudes of one step that keep every parameter within its bounds."""
    lower, upper = -_WIDEST, _WIDEST
    for p in free:
        change = step.get(p.name, 0.0)
        if change == 0.0:
            continue
        start = at.get(p.name, p.null)
        ends = sorted(((p.lower - start) / change, (p.upper - start) / change))
        lower, upper = max(lower, ends[0]), min(upper, ends[1])
    return min(lower, 0.0), max(upper, 0.0)
