"""Losses of many linear models on many residuals, each fold predicted from the others.

Only inner products per fold are kept, so that thousands of fits cost as much as one: the
normal equations of all folds but one are the sums less that one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats

_PRIOR_STEPS = 30.0
"""Amplitudes are expected within so many steps: only matters where the data say nothing."""


@dataclass(frozen=True)
class Products:
    """Inner products per fold (f) of whitened columns (k) and whitened residuals (s).

    ``gram`` (f, k, k), ``cross`` (f, k, s), ``square`` (f, s).
    """

    gram: Floats
    cross: Floats
    square: Floats

    @property
    def total(self) -> Floats:
        """Squared length (s,) of each residual."""
        return np.asarray(self.square.sum(axis=0))

    def only(self, residual: int) -> Products:
        """Of one residual."""
        one = slice(residual, residual + 1)
        return Products(self.gram, self.cross[:, :, one], self.square[:, one])


@dataclass(frozen=True)
class Loss:
    """Squares left over: ``fitted`` (s,) to the data it was fitted to, ``held_out`` (f, s)
    predicted from the other folds; ``amplitudes`` (k, s) on all data and ``fold_amplitudes``
    (f, k, s) without each fold."""

    fitted: Floats
    held_out: Floats
    amplitudes: Floats
    fold_amplitudes: Floats

    @property
    def total(self) -> Floats:
        """Held-out squares (s,) over all folds."""
        return np.asarray(self.held_out.sum(axis=0))


@dataclass(frozen=True)
class Bounded:
    """A column whose amplitude is kept between two bounds."""

    column: int
    lower: float
    upper: float


def products(
    columns: Floats, residuals: Floats, fold: Integers, gram: Floats | None = None
) -> Products:
    """Of whitened ``columns`` (n, k) and ``residuals`` (n, s), which lie in folds (n,); ``gram`` if
    that of the columns is known."""
    folds = np.unique(fold)
    known = gram is not None
    if gram is None:
        gram = np.empty((len(folds), columns.shape[1], columns.shape[1]))
    cross = np.empty((len(folds), columns.shape[1], residuals.shape[1]))
    square = np.empty((len(folds), residuals.shape[1]))
    for index, one in enumerate(folds):
        rows = fold == one
        part, left = columns[rows], residuals[rows]
        if not known:
            gram[index] = part.T @ part
        cross[index] = part.T @ left
        square[index] = np.einsum("ns,ns->s", left, left)
    return Products(gram, cross, square)


def losses(found: Products, chosen: Integers, bounded: tuple[Bounded, ...] = ()) -> Loss:
    """Fit columns ``chosen`` (k,) to every residual; ``bounded`` names columns of all columns."""
    gram = found.gram[:, chosen[:, None], chosen[None, :]]
    cross = found.cross[:, chosen]
    all_gram, all_cross = gram.sum(axis=0), cross.sum(axis=0)
    limits = _limits(chosen, bounded)
    whole = _solve(all_gram[None], all_cross[None], limits)[0]
    parts = _solve(all_gram - gram, all_cross - cross, limits)
    fitted = found.total - _explained(all_gram[None], all_cross[None], whole[None])[0]
    return Loss(fitted, found.square - _explained(gram, cross, parts), whole, parts)


def fitted_losses(found: Products, chosen: Integers, bounded: tuple[Bounded, ...] = ()) -> Floats:
    """As :attr:`Loss.fitted` of :func:`losses` (s,), where nothing is held out."""
    gram = found.gram[:, chosen[:, None], chosen[None, :]].sum(axis=0)[None]
    cross = found.cross[:, chosen].sum(axis=0)[None]
    whole = _solve(gram, cross, _limits(chosen, bounded))
    return np.asarray(found.total - _explained(gram, cross, whole)[0])


def _limits(chosen: Integers, bounded: tuple[Bounded, ...]) -> list[tuple[int, float, float]]:
    return [(int(np.flatnonzero(chosen == b.column)[0]), b.lower, b.upper) for b in bounded]


def _solve(gram: Floats, cross: Floats, limits: list[tuple[int, float, float]]) -> Floats:
    """Amplitudes (f, k, s); those at a bound stay there and the others make the best of it."""
    size = gram.shape[1]
    if not size:
        return np.zeros_like(cross)
    gram = gram + np.eye(size) / _PRIOR_STEPS**2
    amplitudes = np.asarray(np.linalg.solve(gram, cross))
    for at, lower, upper in limits:
        change = np.clip(amplitudes[:, at], lower, upper) - amplitudes[:, at]
        if not change.any():
            continue
        others = np.arange(size) != at
        if others.any():
            pull = np.linalg.solve(gram[:, others][:, :, others], gram[:, others, at][:, :, None])
            amplitudes[:, others] -= pull * change[:, None, :]
        amplitudes[:, at] += change
    return amplitudes


def _explained(gram: Floats, cross: Floats, amplitudes: Floats) -> Floats:
    """How much smaller squares (f, s) are with ``amplitudes`` (f, k, s)."""
    return np.asarray((amplitudes * (2.0 * cross - gram @ amplitudes)).sum(axis=1))
