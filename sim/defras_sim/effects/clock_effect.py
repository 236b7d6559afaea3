"""ClockEffect: a reading was taken earlier than its stamp says."""

from __future__ import annotations

from typing import ClassVar

from defras_sim.effects.effect import Effect, Layer, TwinName, Values


class ClockEffect(Effect):
    """Changes when the depth camera really looked."""

    layer: ClassVar[Layer] = "clock"
    twins: ClassVar[tuple[TwinName, ...]] = ("tissue",)

    def delay_s(self, values: Values) -> float:
        """By how much the tissue in a cloud is older than the cloud's stamp; never negative."""
        return 0.0
