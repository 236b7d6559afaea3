"""All kinds of faults, a file of them, and a run with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.faults.arms import (
    CommandsLost,
    GraspLost,
    JawStuck,
    Jumped,
    NotFollowing,
    Republished,
)
from defras_bt.faults.clouds import Displaced, Noisy, Repeated, Sparse, WrongFrame, WrongUnit
from defras_bt.faults.fault import Fault
from defras_bt.faults.readings import (
    Delayed,
    Dropped,
    Duplicated,
    Frozen,
    Missing,
    NotANumber,
    OutOfOrder,
)
from defras_bt.faults.services import FaultyPlanner, FaultyTwin, FullDisk, NodeBreaker
from defras_bt.faults.system import (
    ClockStopped,
    DiskFull,
    Killed,
    LateTree,
    NodeFault,
    NodeHangs,
    NodeRaises,
    PlannerTimesOut,
    RecorderName,
    TwinDiverges,
    WorldLost,
)
from defras_bt.faults.world import FaultyWorld
from defras_bt.planning.planner import Planner
from defras_bt.recording.record import Recorder
from defras_sim.scene import Scene
from defras_sim.twin import Twin
from defras_sim.worlds.protocol import World

_KINDS: tuple[type[Fault], ...] = (
    Frozen,
    Repeated,
    Dropped,
    Delayed,
    Duplicated,
    OutOfOrder,
    Missing,
    NotANumber,
    WrongUnit,
    WrongFrame,
    Displaced,
    Sparse,
    Noisy,
    NotFollowing,
    Jumped,
    JawStuck,
    CommandsLost,
    Republished,
    GraspLost,
    ClockStopped,
    WorldLost,
    LateTree,
    TwinDiverges,
    PlannerTimesOut,
    NodeRaises,
    NodeHangs,
    DiskFull,
    Killed,
)
KINDS: dict[str, type[Fault]] = {kind.kind: kind for kind in _KINDS}
"""Every kind of fault by its name in files."""

_RECORDERS: dict[RecorderName, str] = {
    "timeline": "TimelineRecorder",
    "recording": "BagRecorder",
    "report": "ReportRecorder",
}


@dataclass(frozen=True)
class Faults:
    """The faults of a run. ``seed`` makes their chance, together with the run's own seed."""

    faults: tuple[Fault, ...] = ()
    seed: int = 0

    def of(self, kind: type[Fault]) -> list[Fault]:
        """The faults of one kind, or of the kinds derived from it."""
        return [fault for fault in self.faults if isinstance(fault, kind)]


NO_FAULTS = Faults()


class FaultInjection:
    """Puts faults to work in one run: each method wraps one part of an operation.

    Where no fault concerns a part, it stays as it is.
    """

    def __init__(self, faults: Faults, scene: Scene, seed: int) -> None:
        self.faults = faults
        self._scene = scene
        self._rng = np.random.default_rng([faults.seed, seed])
        self._world: World | None = None

    def world(self, world: World) -> World:
        """``world`` seen and commanded through the faults."""
        if self.faults.faults:
            injectors = [
                fault.injector(self._scene, rng)
                for fault, rng in zip(
                    self.faults.faults, self._rng.spawn(len(self.faults.faults)), strict=True
                )
            ]
            world = FaultyWorld(world, injectors)
        self._world = world
        return world

    @property
    def trips(self) -> list[tuple[str, ...]]:
        """Per tick, what had to keep the arms still, as those know who made the faults."""
        return self._world.trips if isinstance(self._world, FaultyWorld) else []

    @property
    def hangs(self) -> bool:
        """Whether a node may never return, so that only a deadline ends the run."""
        return bool(self.faults.of(NodeHangs))

    def twin(self, scene: Scene) -> Twin:
        diverges = self.faults.of(TwinDiverges)
        return FaultyTwin(scene, diverges) if diverges else Twin(scene)

    def planner(self, scene: Scene) -> Planner:
        times_out = self.faults.of(PlannerTimesOut)
        return FaultyPlanner(scene, times_out, self._now_s) if times_out else Planner(scene)

    def breaker(self) -> NodeBreaker | None:
        """What breaks nodes of the tree as it is ticked; None if nothing does."""
        faults = [fault for fault in self.faults.faults if isinstance(fault, NodeFault)]
        if not faults or not isinstance(self._world, FaultyWorld):
            return None
        return NodeBreaker(faults, self._now_s, self._world.mark)

    def recorders(self, recorders: Sequence[Recorder]) -> list[Recorder]:
        return [self._on_full_disk(recorder) for recorder in recorders]

    def _on_full_disk(self, recorder: Recorder) -> Recorder:
        name = type(recorder).__name__
        full = [
            fault
            for fault in self.faults.faults
            if isinstance(fault, DiskFull)
            and (
                _RECORDERS.get(fault.recorder) == name
                or (fault.recorder == "all" and name in _RECORDERS.values())
            )
        ]
        return FullDisk(recorder, full) if full else recorder

    def _now_s(self) -> float:
        if self._world is None:
            raise RuntimeError("the faults know no world yet: call world first")
        return self._world.time_s
