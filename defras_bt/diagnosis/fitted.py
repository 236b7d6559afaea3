"""Fitted models: which candidates are in them, and what they leave over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import (
    Approaching,
    Candidate,
    Differentiating,
    Foreseeing,
    Problem,
)
from defras_sim.effects.effect import EffectParameter, Extension
from defras_sim.geometry import Floats


class CountedProblem:
    """A problem's residuals with what was compared first as the yardstick, and calls counted.

    Where an extended model stops predicting a number (it hides a place), the residual of the plain
    model is kept for it, so that nothing is gained or lost by hiding. ``known`` models are not
    predicted twice.
    """

    def __init__(self, problem: Problem, plain: Extension) -> None:
        self.problem = problem
        self.calls = 0
        self._plain = plain
        self._known: dict[str, Floats] = {}
        self._derivatives: tuple[str, Mapping[tuple[str, str], Floats]] | None = None
        self.plain = self._predict(plain)
        if not np.isfinite(self.plain).any():
            raise ValueError("the plain model cannot be compared with any of the data")

    def residual(self, model: Extension) -> Floats:
        """As :meth:`Problem.residual`, NaN only where the plain model's is (or everywhere)."""
        found = self._predict(model)
        if not np.isfinite(found).any():
            return found
        kept = np.where(np.isfinite(found), found, self.plain)
        return np.where(np.isfinite(self.plain), kept, np.nan)

    def foresee(self, models: Sequence[Extension]) -> None:
        """Residuals of ``models`` will be asked for next: the twin may work on several at once."""
        new = {_name(model): model for model in models if _name(model) not in self._known}
        if isinstance(self.problem, Foreseeing) and len(new) > 1:
            self.problem.foresee(tuple(new.values()))

    def approach(self, model: Extension) -> bool:
        """As :meth:`Approaching.approach`; nothing changes where the problem cannot do it."""
        problem = self.problem
        if not isinstance(problem, Approaching) or not problem.approach(model):
            return False
        # Predicted again for little: what took long was remembered by the twin.
        calls, self._known, self._derivatives = self.calls, {}, None
        self.plain = self._predict(self._plain)
        self.calls = calls
        return True

    def derivatives(
        self, model: Extension, candidates: Sequence[Candidate]
    ) -> Mapping[tuple[str, str], Floats]:
        """As :meth:`Differentiating.derivatives`; none where the problem knows none."""
        problem = self.problem
        if not isinstance(problem, Differentiating):
            return {}
        name = repr((_name(model), [c.key for c in candidates]))
        if self._derivatives is None or self._derivatives[0] != name:
            self._derivatives = name, problem.derivatives(model, candidates)
        return self._derivatives[1]

    def _predict(self, model: Extension) -> Floats:
        name = _name(model)
        if name not in self._known:
            self._known[name] = np.asarray(self.problem.residual(model), dtype=float)
            self.calls += 1
        return self._known[name]


def _name(model: Extension) -> str:
    return repr(sorted((effect, sorted(values.items())) for effect, values in model.items()))


@dataclass(frozen=True)
class Fit:
    """``candidates`` fitted together. ``jacobian`` (n, k): change of the prediction per step of
    each of ``free`` (candidate key, parameter); ``residual`` (n,). ``arrived``: whether no step was
    promising any more when it ended."""

    candidates: tuple[Candidate, ...]
    model: Extension
    free: tuple[tuple[str, EffectParameter], ...]
    residual: Floats
    jacobian: Floats
    calls: int = 0
    arrived: bool = True

    @property
    def keys(self) -> tuple[str, ...]:
        return tuple(c.key for c in self.candidates)

    def values_of(self, key: str) -> dict[str, float]:
        """Fitted parameters of one candidate."""
        return {
            p.name: self.model[c.effect.name][p.name]
            for c in self.candidates
            if c.key == key
            for p in c.free
        }


def conflicts(first: Candidate, second: Candidate) -> bool:
    """Whether both need the same parameters of one effect, so that they cannot be together."""
    if first.effect.name != second.effect.name:
        return False
    names = {p.name for p in first.free}
    return bool(names & {p.name for p in second.free}) or first.key == second.key


def added(model: Extension, candidate: Candidate, values: Mapping[str, float]) -> Extension:
    """``model`` with ``values`` of the candidate's effect."""
    name = candidate.effect.name
    return {**model, name: {**model.get(name, {}), **values}}


def begin(counted: CountedProblem, model: Extension) -> Fit:
    """A fit of nothing."""
    residual = counted.residual(model)
    return Fit((), model, (), residual, np.zeros((len(residual), 0)))


def model_without(fit: Fit, key: str) -> Extension:
    """The fitted model less one candidate's parameters."""
    gone = next(c for c in fit.candidates if c.key == key)
    others = [c for c in fit.candidates if c.key != key]
    values = dict(fit.model[gone.effect.name])
    for p in gone.effect.parameters:
        shared = any(c.effect is gone.effect for c in others)
        if p.name in values and (not shared or p in gone.free):
            del values[p.name]
    model = {name: v for name, v in fit.model.items() if name != gone.effect.name}
    return {**model, gone.effect.name: values} if values else model


def bare(counted: CountedProblem, fit: Fit, key: str) -> Fit:
    """``fit`` with one of its candidates taken out and the others left as they are.

    Where the twin cannot follow what is left, that explains no more than the plain model.
    """
    keep = [i for i, (k, _) in enumerate(fit.free) if k != key]
    model = model_without(fit, key)
    residual = counted.residual(model)
    if not np.isfinite(residual).any():
        residual = counted.plain
    return Fit(
        tuple(c for c in fit.candidates if c.key != key),
        model,
        tuple(fit.free[i] for i in keep),
        residual,
        fit.jacobian[:, keep],
    )
