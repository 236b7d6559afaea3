"""Full fits: bounded, damped Gauss-Newton through the twin itself, with few of its predictions.

The first derivatives come from the tangents that ranked the candidate, or from finite differences
where those do not name single parameters, and are kept current by Broyden's rank-one updates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from defras_bt.diagnosis.columns import Option
from defras_bt.diagnosis.fitted import CountedProblem, Fit, added, bare
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.problem import Candidate
from defras_sim.effects.effect import EffectParameter, Extension
from defras_sim.geometry import Floats

_DIFFERENCE = 0.25
"""Of a parameter's step: wide enough to see past a solver's tolerance."""
_SMALLEST_GAIN = 1e-3
"""Relative gain of a step after which a fit has arrived."""
_NOTHING = 0.1
"""Whitened squares that a step has to promise to be worth a prediction: a third of a standard
error."""
_INVISIBLE = 1e-8
"""Whitened squares per sample below which a step of a parameter changes nothing."""
_FINEST = 0.2
"""Of a parameter's step: strides below it are left to derivatives."""


@dataclass(frozen=True)
class Addition:
    """A candidate to add to a fit, begun at ``amplitudes`` (k,) of one of its options."""

    candidate: Candidate
    option: Option
    amplitudes: Floats

    def values(self, share: float) -> dict[str, float]:
        """Its parameters at a share of the amplitudes."""
        return self.option.tangent.values(share * self.amplitudes, self.candidate.free)


def extend(
    counted: CountedProblem,
    fit: Fit,
    additions: Sequence[Addition],
    noise: Noise,
    *,
    iterations: int,
) -> Fit | None:
    """``fit`` with candidates added, all fitted together; None where the twin can follow none of
    the models in their direction."""
    before = counted.calls
    for share in (1.0, 0.5, 0.25):
        start = fit.model
        for one in additions:
            start = added(start, one.candidate, one.values(share))
        residual = counted.residual(start)
        if np.isfinite(residual).any():
            break
    else:
        return None
    candidates = (*fit.candidates, *(one.candidate for one in additions))
    free = fit.free + tuple((o.candidate.key, p) for o in additions for p in o.candidate.free)
    begun = Fit(candidates, start, free, residual, np.zeros((len(residual), 0)))
    known: list[Floats | None] = list(fit.jacobian.T)
    for one in additions:
        known += _from_tangent(one.option, one.candidate.free)
    begun = replace(begun, jacobian=_jacobian(counted, begun, known))
    done = refine(counted, begun, noise, iterations=iterations)
    return replace(done, calls=counted.calls - before)


def without(counted: CountedProblem, fit: Fit, key: str, noise: Noise, *, iterations: int) -> Fit:
    """``fit`` with one of its candidates taken out and the others fitted anew."""
    return refine(counted, bare(counted, fit, key), noise, iterations=iterations)


def refine(counted: CountedProblem, fit: Fit, noise: Noise, *, iterations: int) -> Fit:
    """Gauss-Newton with Levenberg's damping, Broyden's updates and bounds, from ``fit`` on."""
    if not fit.free:
        return fit
    before = counted.calls
    place = np.array([_value(fit.model, fit.candidates, key, p) / p.step for key, p in fit.free])
    lower = np.array([p.lower / p.step for _, p in fit.free])
    upper = np.array([p.upper / p.step for _, p in fit.free])
    lower, upper = np.minimum(lower, upper), np.maximum(lower, upper)
    model, residual, jacobian = fit.model, fit.residual, fit.jacobian.copy()
    damping = 1e-3
    loss = _loss(noise, residual)
    arrived = True
    for number in range(iterations):
        step = _bounded_step(noise, residual, jacobian, damping, lower - place, upper - place)
        if np.abs(step).max() < 1e-4:
            break
        there = np.clip(place + step, lower, upper)
        if np.array_equal(there, place):  # at its bounds
            break
        promised = loss - _loss(noise, residual - jacobian @ (there - place))
        if number and promised < _NOTHING:  # the first step also tells if derivatives are right
            break
        trial = _moved(fit, model, there)
        found = counted.residual(trial)
        if not np.isfinite(found).any():
            damping = max(10.0 * damping, 0.1)
            continue
        # Broyden's update: the least change of the derivative that explains what was seen.
        moved = there - place
        missed = np.nan_to_num(residual - found) - jacobian @ moved
        jacobian = jacobian + np.outer(missed, moved) / float(moved @ moved)
        new_loss = _loss(noise, found)
        if new_loss >= loss:
            damping = max(10.0 * damping, 0.1)
            continue
        gained = (loss - new_loss) / loss
        place, model, residual, loss = there, trial, found, new_loss
        damping = damping / 10.0
        if gained < _SMALLEST_GAIN:
            break
    else:
        arrived = False
    calls = fit.calls + counted.calls - before
    return Fit(fit.candidates, model, fit.free, residual, jacobian, calls, arrived)


def differentiate(counted: CountedProblem, fit: Fit, widths: Floats) -> Fit:
    """``fit`` with its derivatives known anew where it arrived.

    Those that the problem does not know itself are differences over ``widths`` (k,) steps to both
    sides: over about what the parameters are uncertain by, a twin that is rough on a smaller scale
    is judged by what matters.
    """
    before = counted.calls
    known = counted.derivatives(fit.model, fit.candidates)
    measured: dict[int, tuple[Extension, Extension, float]] = {}
    for index, ((key, p), width) in enumerate(zip(fit.free, widths, strict=True)):
        if (key, p.name) in known:
            continue
        candidate = next(c for c in fit.candidates if c.key == key)
        value = _value(fit.model, fit.candidates, key, p)
        ends = np.clip((value - width * p.step, value + width * p.step), p.lower, p.upper)
        below, above = (added(fit.model, candidate, {p.name: float(end)}) for end in ends)
        measured[index] = below, above, max(float(ends[1] - ends[0]) / p.step, 1e-12)
    counted.foresee([model for pair in measured.values() for model in pair[:2]])
    columns = []
    for index, (key, p) in enumerate(fit.free):
        if index in measured:
            below, above, span = measured[index]
            change = counted.residual(below) - counted.residual(above)
            columns.append(np.nan_to_num(change) / span)
        else:
            columns.append(np.nan_to_num(known[key, p.name]) * p.step)
    calls = fit.calls + counted.calls - before
    return replace(fit, jacobian=np.stack(columns, axis=1), calls=calls)


def walked(counted: CountedProblem, fit: Fit, key: str, noise: Noise) -> Fit:
    """``fit`` after trying both neighbours of each of a candidate's parameters, near and nearer:
    for causes whose derivatives lead astray, as play and slip. Those of which the problem itself
    knows derivatives are left as they are."""
    before = counted.calls
    candidate = next(c for c in fit.candidates if c.key == key)
    model, residual = fit.model, fit.residual
    loss = _loss(noise, residual)
    known = counted.derivatives(model, fit.candidates)
    for p in candidate.free:
        if (key, p.name) in known:
            continue
        stride = p.step
        while stride > _FINEST * p.step:
            value = _value(model, fit.candidates, key, p)
            better = False
            ways = [v for v in (value - stride, value + stride) if p.lower <= v <= p.upper]
            trials = [added(model, candidate, {p.name: there}) for there in ways]
            counted.foresee(trials)
            for trial in trials:
                found = counted.residual(trial)
                if np.isfinite(found).any() and _loss(noise, found) < loss:
                    model, residual, loss = trial, found, _loss(noise, found)
                    better = True
                    break
            if not better:
                stride /= 2.0
    calls = fit.calls + counted.calls - before
    return replace(fit, model=model, residual=residual, calls=calls)


def _bounded_step(
    noise: Noise, residual: Floats, jacobian: Floats, damping: float, lower: Floats, upper: Floats
) -> Floats:
    """The step (k,); parameters on which nothing depends stay where they are."""
    white = noise.whiten(np.column_stack((jacobian, np.nan_to_num(residual))))
    squares = (white[:, :-1] ** 2).sum(axis=0)
    seen = squares > _INVISIBLE * len(white)
    step = np.zeros(len(squares))
    if not seen.any():
        return step
    white = white[:, np.append(seen, True)]
    scale = np.sqrt(damping * squares[seen])
    lower, upper = lower[seen], upper[seen]
    # The QR factor holds all that the long columns say.
    triangle = np.asarray(np.linalg.qr(white, mode="r"))
    matrix = np.vstack((triangle[:, :-1], np.diag(scale)))
    target = np.concatenate((triangle[:, -1], np.zeros(len(scale))))
    span = np.maximum(upper - lower, 1e-12)
    found = lsq_linear(matrix, target, (lower - 1e-9 * span, upper + 1e-9 * span))
    step[seen] = found.x
    return step


def _loss(noise: Noise, residual: Floats) -> float:
    return float((noise.whiten(np.nan_to_num(residual)[:, None]) ** 2).sum())


def _from_tangent(option: Option, free: Sequence[EffectParameter]) -> list[Floats | None]:
    """Derivatives by parameter steps, where a column moves one parameter alone."""
    found: list[Floats | None] = [None] * len(free)
    names = [p.name for p in free]
    for step, column in zip(option.tangent.steps, option.columns.T, strict=True):
        moved = [name for name, change in step.items() if change != 0.0]
        if len(moved) == 1 and moved[0] in names:
            index = names.index(moved[0])
            found[index] = column * free[index].step / step[moved[0]]
    return found


def _jacobian(counted: CountedProblem, fit: Fit, known: Sequence[Floats | None]) -> Floats:
    """Change of predictions per step (n, k); ``known`` columns are taken as they are."""
    beside: dict[int, tuple[Extension, float]] = {}
    for index, ((key, p), column) in enumerate(zip(fit.free, known, strict=True)):
        if column is not None:
            continue
        value = _value(fit.model, fit.candidates, key, p)
        change = _DIFFERENCE * p.step
        if not p.lower <= value + change <= p.upper:
            change = -change
        candidate = next(c for c in fit.candidates if c.key == key)
        beside[index] = added(fit.model, candidate, {p.name: value + change}), change
    counted.foresee([model for model, _ in beside.values()])
    columns = []
    for index, ((_, p), column) in enumerate(zip(fit.free, known, strict=True)):
        if column is not None:
            columns.append(column)
            continue
        model, change = beside[index]
        columns.append(np.nan_to_num(fit.residual - counted.residual(model)) * (p.step / change))
    return np.stack(columns, axis=1) if columns else np.zeros((len(fit.residual), 0))


def _value(
    model: Extension, candidates: Sequence[Candidate], key: str, p: EffectParameter
) -> float:
    effect = next(c.effect.name for c in candidates if c.key == key)
    return float(model.get(effect, {}).get(p.name, p.null))


def _moved(fit: Fit, model: Extension, place: Floats) -> Extension:
    for (key, p), value in zip(fit.free, place, strict=True):
        candidate = next(c for c in fit.candidates if c.key == key)
        kept = float(np.clip(value * p.step, p.lower, p.upper))
        model = added(model, candidate, {p.name: kept})
    return model
