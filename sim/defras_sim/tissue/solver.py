"""Minima of a potential energy, by a quasi-Newton method on top of a sparse factorisation.

Assembling and factorising the tangent of 12x12x1 elements takes as long as ten energies with their
gradients and solutions with a known factor. So one factorisation serves for as many steps, and for
as many motions of the tip, as it pays. Where steps shrink slowly the tangent is factorised anew,
which is Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse

from defras_sim.geometry import Floats
from defras_sim.tissue.curvature import Curvature
from defras_sim.tissue.factorisation import NotPositiveDefinite

# What is added to the tangent's diagonal first where it bends down, as a share of its median.
_LEAST_SHIFT = 1e-6
# Forces below this share of the residual are rounding. The tangent need not be looked at then; that
# of tissue at rest which nothing holds has no factor.
_NOTHING = 1e-6


class Energy(Protocol):
    """What is minimised; see :class:`defras_sim.tissue.equilibrium.PotentialEnergy`."""

    def energy_and_gradient(self, positions_m: Floats) -> tuple[float, Floats]: ...

    def tangent(self, positions_m: Floats) -> sparse.csc_array: ...


@dataclass(frozen=True)
class NewtonSettings:
    """When a solve has converged, and how much work it may be.

    Converged: the norm of the unbalanced nodal forces is at most ``residual_n``, and the next step
    would move no node by more than ``motion_m``. The first bounds the error of forces. It says
    little about a loose flap, which a micronewton moves by a millimetre; the second does.

    ``patience`` counts the steps that take about as long as a new factorisation.
    """

    residual_n: float
    motion_m: float = 1e-5
    max_iterations: int = 100
    max_factorisations: int = 60
    max_step_m: float = 0.01
    sufficient_decrease: float = 1e-4
    min_step_share: float = 1 / 512
    patience: float = 16.0


@dataclass(frozen=True)
class Solution:
    """``positions_m`` (nodes, 3) at the smallest energy found; never NaN."""

    positions_m: Floats
    converged: bool
    iterations: int
    factorisations: int = 0


@dataclass(frozen=True)
class _Point:
    """Where the descent stands: positions (nodes, 3), the energy there, and its gradient."""

    positions_m: Floats
    energy_j: float
    gradient_n: Floats


class NewtonSolver:
    """Finds minima of energies of the same nodes; remembers what it knows of their curvature."""

    def __init__(self, settings: NewtonSettings) -> None:
        self.settings = settings
        self._curvature: Curvature | None = None
        self._known = False
        self._shift_share = 0.0
        self._last_shift_share = 0.0

    def forget(self) -> None:
        """Drop the curvature: the next energy has little in common with the last."""
        self._known = False
        self._shift_share = 0.0

    def minimise(self, energy: Energy, start_m: Floats) -> Solution:
        """Descend from ``start_m`` (nodes, 3) to an equilibrium."""
        settings = self.settings
        here = _Point(start_m.copy(), *energy.energy_and_gradient(start_m))
        if not np.isfinite(here.energy_j):
            return Solution(here.positions_m, False, 0)
        if np.linalg.norm(here.gradient_n) <= _NOTHING * settings.residual_n:
            return Solution(here.positions_m, True, 0)
        curvature = self._curvature = self._curvature or Curvature(start_m)
        iterations = factorisations = 0
        excess = np.inf
        while iterations < settings.max_iterations:
            fresh = not self._known
            if fresh:
                if factorisations == settings.max_factorisations:
                    break
                factorisations += 1
                if not self._factorise(curvature, energy.tangent(here.positions_m), here):
                    continue
            else:
                curvature.look_from(here.positions_m)
            step_m = curvature.newton_step(here.gradient_n)
            before, excess = excess, self._excess(here.gradient_n, step_m)
            if excess <= 1.0 and self._shift_share == 0.0:
                return Solution(here.positions_m, True, iterations, factorisations)
            there = None
            if fresh or self._pays(before, excess):
                there = self._line_search(energy, here, step_m)
            if there is None:
                # Where even an exact tangent gives no good step, shorter ones may be.
                self._shift_share = self._more_shift() if fresh else 0.0
                self._known, excess = False, np.inf
                continue
            curvature.learn(
                there.positions_m - here.positions_m, there.gradient_n - here.gradient_n
            )
            here = there
            iterations += 1
        return Solution(here.positions_m, False, iterations, factorisations)

    def _factorise(self, curvature: Curvature, tangent: sparse.csc_array, here: _Point) -> bool:
        """Whether the tangent, with the shift that it is given, has a factor."""
        shift = self._shift_share * float(np.median(tangent.diagonal()))
        try:
            curvature.factorise(tangent, here.positions_m, shift)
        except NotPositiveDefinite:
            self._shift_share = self._more_shift()
            return False
        self._known = True
        self._last_shift_share = self._shift_share or self._last_shift_share
        return True

    def _more_shift(self) -> float:
        if self._shift_share > 0:
            return 10 * self._shift_share
        return max(_LEAST_SHIFT, 0.1 * self._last_shift_share)

    def _excess(self, gradient_n: Floats, step_m: Floats) -> float:
        """How many times too large the unbalanced forces, or the next step, still are."""
        residual_n = float(np.linalg.norm(gradient_n))
        return max(residual_n / self.settings.residual_n, _longest(step_m) / self.settings.motion_m)

    def _pays(self, before: float, excess: float) -> bool:
        """Whether steps that shrink like the last end sooner than after another factorisation."""
        if not np.isfinite(before):
            return True
        return excess < before and bool(
            np.log(excess) <= self.settings.patience * np.log(before / excess)
        )

    def _line_search(self, energy: Energy, here: _Point, step_m: Floats) -> _Point | None:
        """Backtrack until the energy falls enough; None if it never does."""
        settings = self.settings
        slope = float(np.sum(here.gradient_n * step_m))
        if not slope < 0:
            return None
        share = most = min(1.0, settings.max_step_m / _longest(step_m))
        rounding = 1e-12 * abs(here.energy_j)
        while share >= settings.min_step_share * most:
            there = here.positions_m + share * step_m
            value, gradient = energy.energy_and_gradient(there)
            enough = here.energy_j + settings.sufficient_decrease * share * slope + rounding
            if value <= enough and np.all(np.isfinite(gradient)):
                return _Point(there, value, gradient)
            share *= 0.5
        return None


def _longest(step_m: Floats) -> float:
    """How far the node that moves farthest moves."""
    return float(np.sqrt((step_m**2).sum(axis=1).max()))
