"""The safe motion that would tell apart what this data cannot.

Planned motions are problems without data: what sensors would be compared, what each candidate
would change, and how large the force would become.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from defras_bt.diagnosis.columns import Option, sketch
from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Linearised
from defras_sim.effects.effect import EffectParameter, Extension
from defras_sim.geometry import Floats


class PlannedMotion(Linearised, Protocol):
    """A motion that nobody has made yet: what would be compared, and what causes would change."""

    @property
    def sentence(self) -> str:
        """What would be done, in words."""
        ...

    @property
    def peak_force_n(self) -> float:
        """The largest force that the twin expects in it [N]."""
        ...


Strengths = Mapping[str, Mapping[str, float]]
"""By key of each candidate in question, its parameters as fitted to the data."""


@runtime_checkable
class Planning(Protocol):
    """A problem that knows which other motions could be made of what was recorded."""

    @property
    def force_limit_n(self) -> float:
        """The largest force that a jaw may exert in them [N]."""
        ...

    def planned_motions(
        self, model: Extension, strengths: Strengths, rng: np.random.Generator
    ) -> Sequence[PlannedMotion]:
        """Motions beside ``model``, which has none of the candidates in question; their tangents
        are those at ``model``."""
        ...


@dataclass(frozen=True)
class Separation:
    """``separation``: how far apart the two most alike of the candidates would be, in standard
    deviations of the noise, if each had the strength that explains the data now."""

    motion: PlannedMotion
    separation: float


def separating_motions(
    motions: Sequence[PlannedMotion],
    model: Extension,
    strengths: Strengths,
    force_limit_n: float,
    independent_share: float = 1.0,
) -> tuple[Separation, ...]:
    """Motions that stay below ``force_limit_n`` [N], the one that separates best first.

    Args:
        motions: planned motions to choose from.
        model: the model without the candidates in question.
        strengths: by key of each candidate in question, its parameters as fitted to the data.
        force_limit_n: motions that would exceed it are left out.
        independent_share: how many independent samples a sample is worth, from the noise of the
            data (autocorrelated noise: far below 1).

    Raises:
        ValueError: fewer than two candidates are in question, or a motion does not know one.
    """
    if len(strengths) < 2:
        raise ValueError("to tell causes apart takes two of them; one or none was given")
    found = [
        Separation(motion, float(np.sqrt(independent_share)) * _smallest(motion, model, strengths))
        for motion in motions
        if motion.peak_force_n <= force_limit_n
    ]
    return tuple(sorted(found, key=lambda one: -one.separation))


def _smallest(motion: PlannedMotion, model: Extension, strengths: Strengths) -> float:
    known = {c.key: c for c in motion.candidates}
    missing = [key for key in strengths if key not in known]
    if missing:
        raise ValueError(
            f"motion {motion.sentence!r} has no candidate {missing[0]}; it has: {', '.join(known)}"
        )
    beside = [c for c in motion.candidates if (c.nuisance or c.base) and c.key not in strengths]
    there = sketch(motion, model, [*(known[key] for key in strengths), *beside])
    weight = 1.0 / tolerances(motion.samples)[motion.samples.channel][:, None]
    always = [there.options[c.key][0].columns * weight for c in beside if there.options[c.key]]
    changes = {
        key: _change(there.options[key], strengths[key], known[key].free) * weight[:, 0]
        for key in strengths
    }
    spans = {
        key: np.concatenate(
            [
                np.zeros((len(weight), 0)),
                *always,
                *(o.columns * weight for o in there.options[key]),
            ],
            axis=1,
        )
        for key in strengths
    }
    apart = [
        _unexplained(changes[one], spans[other])
        for one in strengths
        for other in strengths
        if one != other
    ]
    return min(apart)


def _change(
    options: Sequence[Option], values: Mapping[str, float], free: Sequence[EffectParameter]
) -> Floats:
    """What a candidate of these values would change, by the option that comes nearest to them."""
    best: tuple[float, Floats] | None = None
    for option in options:
        names = [p.name for p in free]
        steps = np.array([[step.get(n, 0.0) for step in option.tangent.steps] for n in names])
        scale = np.array([p.step for p in free])[:, None]
        wanted = np.array(
            [values.get(p.name, p.null) - option.tangent.at.get(p.name, p.null) for p in free]
        )
        amplitudes = np.linalg.lstsq(steps / scale, wanted / scale[:, 0], rcond=None)[0]
        missed = float(np.linalg.norm((steps @ amplitudes - wanted) / scale[:, 0]))
        # Of secants that can all be stretched to the strength, the one that is stretched least.
        missed += float(np.abs(amplitudes - 1.0).sum()) * 1e-3
        if best is None or missed < best[0]:
            best = (missed, option.columns @ amplitudes)
    if best is None:
        raise ValueError("a candidate that the twin cannot follow has no change to look for")
    return best[1]


def _unexplained(change: Floats, span: Floats) -> float:
    """Length of ``change`` (n,) beside what columns ``span`` (n, k) can imitate."""
    left, size, _ = np.linalg.svd(span, full_matrices=False)
    basis = left[:, size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)]
    return float(np.linalg.norm(change - basis @ (basis.T @ change)))
