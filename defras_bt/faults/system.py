"""Faults of the world as a whole, and of the program itself."""

from __future__ import annotations

import os
import signal
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from defras_bt.executive.deadline import TreeStuck
from defras_bt.faults.fault import Fault, Injector
from defras_sim.scene import Scene
from defras_sim.worlds.error import WorldError
from defras_sim.worlds.protocol import Observation

RecorderName = Literal["timeline", "recording", "report", "all"]


class ClockStopped(Fault):
    """The world's clock stands still: every reading looks as fresh as ever."""

    kind: ClassVar[str] = "clock_stopped"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _ClockStopped(self, rng)


class _ClockStopped(Injector):
    def __init__(self, fault: Fault, rng: np.random.Generator) -> None:
        super().__init__(fault, rng)
        self._stopped_s: float | None = None

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.trip = ""
        if not self._fault.active(true.time_s):
            self._stopped_s = None
            return delivered
        if self._stopped_s is None:
            self._stopped_s = true.time_s
        else:
            self.trip = "the clock stands still"
        arms = {name: replace(arm, stamp_s=self._stopped_s) for name, arm in delivered.arms.items()}
        return replace(delivered, time_s=self._stopped_s, arms=arms)


class WorldLost(Fault):
    """The connection to the world breaks: its next step fails."""

    kind: ClassVar[str] = "world_lost"
    ends_runs_with: ClassVar[tuple[type[Exception], ...]] = (WorldError,)

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _WorldLost(self, rng)


class _WorldLost(Injector):
    def step(self, time_s: float) -> None:
        if self.happens(time_s):
            self.trip = "the world is lost"
            raise WorldError(f"at {time_s:.2f} s the connection to the world was lost")


class Killed(Fault):
    """The process is killed, as by kill -9: no program can catch that."""

    kind: ClassVar[str] = "killed"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Killed(self, rng)


class _Killed(Injector):
    def step(self, time_s: float) -> None:
        if self.happens(time_s):
            os.kill(os.getpid(), signal.SIGKILL)


class LateTree(Fault):
    """World time runs on while the tree thinks, by ``seconds`` in each tick."""

    kind: ClassVar[str] = "late_tree"
    seconds: Annotated[float, Field(gt=0)] = 1.0

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _LateTree(self, scene, rng)


class _LateTree(Injector):
    _fault: LateTree

    def __init__(self, fault: Fault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, rng)
        self._max_age_s = scene.thresholds.max_age_s
        self._late = False

    @property
    def late_s(self) -> float:
        return self._fault.seconds if self._late else 0.0

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self._late = self.happens(true.time_s)
        self.trip = "the tree is late" if self.late_s > self._max_age_s else ""
        return delivered


class ServiceFault(Fault):
    """Base of the faults that the world has no part in."""

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return Injector(self, rng)


class TwinDiverges(ServiceFault):
    """The twin finds no equilibrium any more: what tissue and force are, it cannot say."""

    kind: ClassVar[str] = "twin_diverges"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _TwinDiverges(self, rng)


class _TwinDiverges(Injector):
    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.trip = "the twin does not converge" if self._fault.active(true.time_s) else ""
        return delivered


class PlannerTimesOut(ServiceFault):
    """The planner finds no answer within its time."""

    kind: ClassVar[str] = "planner_times_out"


class NodeFault(ServiceFault):
    """Base of the faults of a node; ``node`` is its path in the tree, with wildcards."""

    node: str = Field(default="**/act/*", min_length=1, description="path; *, ? and ** are wild")


class InjectedFault(RuntimeError):
    """What a node raises because a fault file says so."""


class NodeRaises(NodeFault):
    """A node raises an exception."""

    kind: ClassVar[str] = "node_raises"
    ends_runs_with: ClassVar[tuple[type[Exception], ...]] = (InjectedFault,)


class NodeHangs(NodeFault):
    """A node never returns."""

    kind: ClassVar[str] = "node_hangs"
    ends_runs_with: ClassVar[tuple[type[Exception], ...]] = (TreeStuck,)


class DiskFull(ServiceFault):
    """Nothing more can be written by one recorder, or by all."""

    kind: ClassVar[str] = "disk_full"
    ends_recorders_with: ClassVar[tuple[type[Exception], ...]] = (OSError,)
    recorder: RecorderName = "recording"


def trips(injectors: Sequence[Injector]) -> tuple[str, ...]:
    """What must keep every arm still now."""
    return tuple(injector.trip for injector in injectors if injector.trip)
