"""From one equilibrium to another, through equilibria at tip poses in between."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.tissue.path import Trail, between, length_m, markers_m
from defras_sim.tissue.solver import Energy, NewtonSolver, Solution

# Of the tip between two equilibria on the way to a far one.
MAX_TIP_STEP_M = 0.004
# Of the tip to an equilibrium at which the nodes' places are about known.
MAX_KNOWN_STEP_M = 0.012
# Nearly all the work is factorising. A step takes one or two, a snap into another shape up to 60:
# with so many beside those of each step, a way that leads nowhere ends within two seconds or three.
SPARE_FACTORISATIONS = 100
FACTORISATIONS_PER_STEP = 4
MAX_FACTORISATIONS = 300

Tips = Mapping[str, Pose]
"""``tissue_from_tip`` of every arm that holds tissue."""


@dataclass(frozen=True)
class Arrival:
    """The last equilibrium of a way: ``positions_m`` (nodes, 3), with the arms at ``tips``.

    ``arrived`` False says that the way ends before its goal.
    """

    positions_m: Floats
    tips: Tips
    arrived: bool
    iterations: int


class Traveller:
    """Goes through equilibria of the energies that ``energy_at`` gives for the tips' poses.

    All of them share one sparsity until :meth:`forget` is called.
    """

    def __init__(self, solver: NewtonSolver, energy_at: Callable[[Tips], Energy]) -> None:
        self._solver = solver
        self._energy_at = energy_at
        self._trail = Trail()

    def forget(self) -> None:
        """What comes next does not continue what was before."""
        self._trail.clear()
        self._solver.forget()

    def go(
        self, positions_m: Floats, starts: Tips, ends: Tips, change_m: Floats | None = None
    ) -> Arrival:
        """From the equilibrium ``positions_m`` (nodes, 3) at ``starts`` to the one at ``ends``.

        Long ways are gone in steps of some millimetres, halved where one fails; at once, where
        ``change_m`` (nodes, 3) says about how far the nodes go, and the end is not too far.
        """
        way = length_m(starts, ends)
        if change_m is not None and way <= MAX_KNOWN_STEP_M:
            known = self._step(positions_m, ends, [positions_m + change_m])
            if known.converged:
                return Arrival(known.positions_m, ends, True, known.iterations)
        steps = max(1.0, np.ceil(way / MAX_TIP_STEP_M))
        step = 1.0 / steps
        smallest = step / 16 if way > 0 else step
        most = min(MAX_FACTORISATIONS, SPARE_FACTORISATIONS + FACTORISATIONS_PER_STEP * steps)
        share, tips = 0.0, starts
        iterations = factorisations = 0
        while share < 1.0 and step >= smallest and factorisations <= most:
            aim = min(1.0, share + step)
            ahead = {arm: between(start, ends[arm], aim) for arm, start in starts.items()}
            solution = self._step(positions_m, ahead)
            iterations += solution.iterations
            factorisations += solution.factorisations
            if solution.converged:
                positions_m, tips = solution.positions_m, ahead
                share, step = aim, 1.5 * step
            else:
                step *= 0.5
        return Arrival(positions_m, tips, share >= 1.0, iterations)

    def _step(self, positions_m: Floats, tips: Tips, known_m: Sequence[Floats] = ()) -> Solution:
        """Solve at ``tips``, from the lowest of the positions so far and those expected."""
        energy = self._energy_at(tips)
        markers = markers_m(tips)
        starts = [positions_m, *known_m, *self._trail.guesses(markers)]
        energies = [energy.energy_and_gradient(start)[0] for start in starts]
        solution = self._solver.minimise(energy, starts[int(np.argmin(energies))])
        if solution.converged:
            self._trail.add(markers, solution.positions_m)
        else:
            self.forget()
        return solution
