"""What an effect does to a specimen that is pulled along one axis.

A specimen has no mesh: it is incompressible, at the same stretch everywhere, free to contract
across, so its stress follows from the stretch alone. Each effect changes the stress that those
before it left.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal

from defras_sim.effects.effect import Values
from defras_sim.geometry import Floats

CouponStage = Literal["elastic", "damage", "memory"]
"""In this order: what depends on the stretch now, on the largest so far, on all of the past."""


@dataclass(frozen=True)
class Pull:
    """A specimen over time, each (n,): ``time_s`` rises, ``stretch`` is 1 at rest.

    ``energy_j_m3`` is the elastic energy density, ``stress_pa`` the nominal stress (force by
    unstretched area) that the law has at each row so far.
    """

    time_s: Floats
    stretch: Floats
    energy_j_m3: Floats
    stress_pa: Floats

    @property
    def invariant(self) -> Floats:
        """I1 - 3 of the incompressible specimen (n,), zero at rest."""
        return self.stretch**2 + 2 / self.stretch - 3


class CouponEffect(ABC):
    """Beside :class:`defras_sim.effects.effect.Effect`, of an effect that a specimen can show."""

    coupon_stage: ClassVar[CouponStage]

    @abstractmethod
    def on_coupon(self, values: Values, pull: Pull) -> Pull:
        """``pull`` with this effect's energy and stress; equal to ``pull`` at the null values."""
