"""The interface of every measure of disagreement between a cloud and the twin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from defras_bt.monitoring.seen import SeenSurface
from defras_sim.geometry import Floats


@dataclass(frozen=True)
class Measurement:
    """``value_m``: the disagreement, NaN where it cannot be said; ``per_point_m`` (n,)."""

    value_m: float
    per_point_m: Floats


class Metric(Protocol):
    """Anything that compares an observed cloud with what the twin says is visible."""

    @property
    def name(self) -> str:
        """How readings and trees call it."""

    def measure(self, cloud_m: Floats, seen: SeenSurface) -> Measurement:
        """Compare finite points (n, 3) in the tissue frame with the visible simulated surface."""
