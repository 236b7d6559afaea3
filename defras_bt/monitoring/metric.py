"""The interface of every measure of disagreement between a cloud and the twin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

from defras_bt.monitoring.seen import SeenSurface
from defras_sim.geometry import Floats


@dataclass(frozen=True)
class Measurement:
    """``value_m``: the disagreement, NaN where it cannot be said.

    ``distances`` makes :attr:`per_point_m`, when somebody wants it.
    """

    value_m: float
    distances: Callable[[], Floats] = field(repr=False, compare=False)

    @cached_property
    def per_point_m(self) -> Floats:
        """The distance at each point of the cloud (n,)."""
        return self.distances()


class Metric(Protocol):
    """Anything that compares an observed cloud with what the twin says is visible."""

    @property
    def name(self) -> str:
        """How readings and trees call it."""

    def measure(self, cloud_m: Floats, seen: SeenSurface) -> Measurement:
        """Compare finite points (n, 3) in the tissue frame with the visible simulated surface."""
