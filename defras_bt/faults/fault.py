"""What every injected fault has in common: when it is there, and what it may touch."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from defras_sim.scene import Scene
from defras_sim.worlds.protocol import Command, Observation

Seconds = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(gt=0, le=1)]


class Fault(BaseModel):
    """One entry of a fault file. Times are world time.

    A subclass is one kind of fault: its docstring says in a sentence what goes wrong, ``kind`` is
    its name in files, and :meth:`injector` puts it to work.

    ``ends_runs_with`` and ``ends_recorders_with`` are the exceptions that it may end a run or a
    recorder with; a judge takes any other for a mistake in the program.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    kind: ClassVar[str]
    ends_runs_with: ClassVar[tuple[type[Exception], ...]] = ()
    ends_recorders_with: ClassVar[tuple[type[Exception], ...]] = ()

    start_s: Seconds = Field(default=0.0, description="when it begins")
    duration_s: Annotated[float, Field(gt=0)] | None = Field(
        default=None, description="how long it lasts; to the end if not said"
    )
    probability: Share = Field(default=1.0, description="how likely each time it could happen")

    def active(self, time_s: float) -> bool:
        """Whether the fault may happen at ``time_s``."""
        end_s = np.inf if self.duration_s is None else self.start_s + self.duration_s
        return self.start_s <= time_s < end_s

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        """The fault at work in one run of ``scene``; chance comes from ``rng``."""
        raise NotImplementedError


class Injector:
    """A fault at work in one run. What it leaves alone passes through.

    ``trip`` says, after each observation, what must keep every arm still from now on, as those know
    who made the fault and the rules of safety, but not the executive; "" while nothing does. A
    judge compares it with what was commanded.
    """

    def __init__(self, fault: Fault, rng: np.random.Generator) -> None:
        self._fault = fault
        self._rng = rng
        self.trip = ""

    @property
    def late_s(self) -> float:
        """How far world time runs on while the tree thinks."""
        return 0.0

    def happens(self, time_s: float) -> bool:
        """Whether it happens now; asks chance, so ask once."""
        if not self._fault.active(time_s):
            return False
        return self._fault.probability >= 1.0 or self._rng.random() < self._fault.probability

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        """What arrives. ``true`` came from the world, ``delivered`` is what earlier faults made."""
        return delivered

    def commanded(self, command: Command, true: Observation) -> Command:
        """What reaches the arms."""
        return command

    def step(self, time_s: float) -> None:
        """Called before the world steps from ``time_s`` on; may raise what a lost world raises."""
