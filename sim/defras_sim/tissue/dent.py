"""The dent that a held disc makes in the tissue, as a law between its pull and its depth.

In series with a spring of stiffness k, a pull F stretches both together by

    s = F / k + c F / (1 + F / h),

where the second part is the dent: it is ``give`` c per newton at first and hardens at about h, as
soft tissue does that is drawn into a hole. The law has a closed form both ways, and an energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats


@dataclass(frozen=True)
class Dent:
    """``give_m_per_n`` (r,), at least 0, and ``hardening_n`` (r,), above 0, of r held quantities.

    Methods take the springs' stiffness (r,) [N/m], zero where nothing holds, and the size of the
    stretch (r,) [m].
    """

    give_m_per_n: Floats
    hardening_n: Floats

    @staticmethod
    def none(count: int) -> Dent:
        """Tissue that does not give way."""
        return Dent(np.zeros(count), np.ones(count))

    def with_some(self, which: NDArray[np.bool_], others: Dent) -> Dent:
        """The same with those of ``which`` (r,) replaced by ``others``, in order."""
        give, hardening = self.give_m_per_n.copy(), self.hardening_n.copy()
        give[which], hardening[which] = others.give_m_per_n, others.hardening_n
        return Dent(give, hardening)

    def scaled(self, factor: float) -> Dent:
        """The same in tissue that is ``factor`` times as stiff."""
        return Dent(self.give_m_per_n / factor, self.hardening_n * factor)

    def pull_n(self, stiffness_n_per_m: Floats, stretch_m: Floats) -> Floats:
        """Pull F (r,) at a stretch: the positive root of F^2 / h + b F - k s = 0."""
        free = stiffness_n_per_m * stretch_m  # the pull if the tissue did not give way
        b = 1 + stiffness_n_per_m * self.give_m_per_n - free / self.hardening_n
        root = np.sqrt(b**2 + 4 * free / self.hardening_n)
        # Two forms of one number; each keeps its digits on its side of b = 0.
        return np.where(b > 0, 2 * free / (b + root), (root - b) / 2 * self.hardening_n)

    def slope_n_per_m(self, stiffness_n_per_m: Floats, pull_n: Floats) -> Floats:
        """Derivative (r,) of the pull by the stretch."""
        return stiffness_n_per_m / (1 + stiffness_n_per_m * self.slope_m_per_n(pull_n))

    def energy_j(self, stiffness_n_per_m: Floats, stretch_m: Floats, pull_n: Floats) -> Floats:
        """Energy (r,) of spring and dent together: F s less the complementary energy."""
        holds = stiffness_n_per_m > 0
        in_spring = np.where(holds, pull_n**2 / (2 * np.where(holds, stiffness_n_per_m, 1.0)), 0.0)
        share = pull_n / self.hardening_n
        in_dent = self.give_m_per_n * self.hardening_n**2 * (share - np.log1p(share))
        return pull_n * stretch_m - in_spring - in_dent

    def strain_energy_j(self, pull_n: Floats) -> Floats:
        """The dent's own part (r,) of the energy: strain of the tissue."""
        share = pull_n / self.hardening_n
        complementary = self.give_m_per_n * self.hardening_n**2 * (share - np.log1p(share))
        return self.secant_m_per_n(pull_n) * pull_n**2 - complementary

    def secant_m_per_n(self, pull_n: Floats) -> Floats:
        """Depth (r,) of the dent per newton of its pull."""
        return self.give_m_per_n / (1 + pull_n / self.hardening_n)

    def slope_m_per_n(self, pull_n: Floats) -> Floats:
        """Derivative (r,) of the depth by the pull."""
        return self.give_m_per_n / (1 + pull_n / self.hardening_n) ** 2
