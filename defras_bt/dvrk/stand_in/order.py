"""What to stand in for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from defras_bt.dvrk.stand_in.faults import StandInFault
from defras_bt.dvrk.stand_in.imperfections import Imperfections
from defras_bt.dvrk.stand_in.operating import Operating
from defras_sim.scene import Scene

Clock = Literal["real", "simulated"]
WorldName = Literal["model", "bullet"]

PERIOD_S = 0.01
"""A dVRK publishes at 100 Hz unless told otherwise."""

WORLD_TICKS_S: Mapping[WorldName, float] = MappingProxyType({"model": 0.05, "bullet": 0.02})
"""How often the patient is told where the tips are. Tissue in equilibrium depends on where they
are, not on how often it is asked, and an answer costs tens of milliseconds."""


@dataclass(frozen=True)
class StandInOrder:
    """``actual``: the scene as it really is. ``speed``: of a simulated clock, at most, as a
    multiple of the wall's. ``witness``: file for what really happened."""

    actual: Scene
    world: WorldName = "model"
    imperfections: Imperfections = field(default_factory=Imperfections)
    seed: int = 0
    master_uri: str = "http://localhost:11311"
    clock: Clock = "real"
    speed: float = 1.0
    operating: Operating = field(default_factory=Operating)
    faults: tuple[StandInFault, ...] = ()
    witness: Path | None = None

    @property
    def world_tick_s(self) -> float:
        """Of the patient's world."""
        return WORLD_TICKS_S[self.world]

    @property
    def simulated_clock(self) -> bool:
        return self.clock == "simulated"
