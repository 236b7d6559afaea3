"""What problems of the twins without tissue share: predictions that cost milliseconds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Integers, Samples, Tangent
from defras_bt.diagnosis.quality import DataQuality
from defras_sim.effects.effect import Effect, Extension, Values
from defras_sim.geometry import Floats

FOLDS = 6
"""At least as many parts are held out in turn; fewer cannot tell luck from gain."""


class TableProblem(ABC):
    """Measured numbers beside predictions; a :class:`defras_bt.diagnosis.problem.Problem`."""

    def __init__(
        self,
        samples: Samples,
        candidates: tuple[Candidate, ...],
        measured: Floats,
        quality: DataQuality,
    ) -> None:
        """``measured`` (n,), NaN where nothing was measured."""
        self._samples = samples
        self._candidates = candidates
        self._measured = measured
        self.quality = quality

    @property
    def samples(self) -> Samples:
        return self._samples

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        return self._candidates

    @property
    def measured(self) -> Floats:
        """What was measured (n,), NaN where nothing was."""
        return self._measured

    @abstractmethod
    def predicted(self, model: Extension) -> Floats:
        """What the twin says with the effects of ``model`` (n,)."""

    def residual(self, model: Extension) -> Floats:
        """Measured minus predicted (n,)."""
        return self._measured - self.predicted(model)

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        """Derivatives by differences; secants where the null point has none."""
        present = candidate.effect.complete(model.get(candidate.effect.name, {}))
        if all(present[p.name] == p.null for p in candidate.free if p.strength):
            starts = self.starts(model, candidate)
            if starts:
                return [self._linear(model, candidate, *start) for start in starts]
        return [self._differences(model, candidate, present)]

    def starts(
        self, model: Extension, candidate: Candidate
    ) -> Sequence[tuple[Values, Sequence[Values]]]:
        """Where the null point has no derivative: places ``at`` where the effect still does
        nothing, and ``steps`` from there in which the prediction is linear. None by default."""
        return ()

    def _linear(
        self, model: Extension, candidate: Candidate, at: Values, steps: Sequence[Values]
    ) -> Tangent:
        here = self.predicted(added(model, candidate.effect, at))
        columns = [
            self.predicted(added(model, candidate.effect, moved(at, step))) - here for step in steps
        ]
        return Tangent(dict(at), tuple(steps), np.stack(columns, axis=1))

    def _differences(
        self, model: Extension, candidate: Candidate, present: Mapping[str, float]
    ) -> Tangent:
        """Central differences of a hundredth of each parameter's step, one-sided at its bounds."""
        steps, columns = [], []
        for parameter in candidate.free:
            at, change = present[parameter.name], 0.01 * parameter.step
            high = min(at + change, parameter.upper)
            low = max(at - change, parameter.lower)
            above, below = (
                self.predicted(added(model, candidate.effect, {parameter.name: value}))
                for value in (high, low)
            )
            steps.append({parameter.name: parameter.step})
            columns.append((above - below) * (parameter.step / (high - low)))
        at_free = {p.name: present[p.name] for p in candidate.free}
        return Tangent(at_free, tuple(steps), np.stack(columns, axis=1))


def added(model: Extension, effect: Effect, values: Values) -> dict[str, Values]:
    """``model`` with parameters of ``effect`` set; its others stay."""
    return {**model, effect.name: {**model.get(effect.name, {}), **values}}


def moved(at: Values, step: Values) -> dict[str, float]:
    return {**at, **{name: at.get(name, 0.0) + change for name, change in step.items()}}


def fold_of_rows(rows: Sequence[int], folds: int = FOLDS, rounds: int = 1) -> list[Integers]:
    """Fold (rows,) of each row of each trajectory, given their numbers of rows.

    Trajectories are folds where there are enough of them. Otherwise each is cut into stretches
    that make enough folds together; in several ``rounds``, a fold gets a stretch of each round, so
    that what rises all the time is held out at every height and not only at its end.
    """
    parts = max(1, -(-folds // len(rows)))
    found = []
    for trajectory, count in enumerate(rows):
        times = rounds if parts > 1 else 1
        stretch = np.arange(count) * parts * times // max(count, 1) % parts
        found.append((trajectory * parts + stretch).astype(np.int64))
    return found
