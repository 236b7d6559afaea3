"""Twin, planner, nodes and recorders with faults."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import py_trees
from numpy.typing import NDArray
from py_trees.behaviour import Behaviour

from defras_bt.executive.node import Node
from defras_bt.executive.wildcard import path_matches
from defras_bt.faults.fault import Fault
from defras_bt.faults.system import DiskFull, InjectedFault, NodeFault, NodeHangs
from defras_bt.planning.plan import GridPoint, Plan, Situation
from defras_bt.planning.planner import Planner
from defras_bt.planning.program import PlanningTimeout
from defras_bt.recording.record import Recorder, RunInfo, RunSummary, TickRecord
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.tissue.state import TissueState
from defras_sim.twin import Twin


class FaultyTwin(Twin):
    """A twin that finds no equilibrium while one of ``faults`` is there."""

    def __init__(self, scene: Scene, faults: Sequence[Fault]) -> None:
        super().__init__(scene)
        self._faults = tuple(faults)
        self._lost = False

    @property
    def force_n(self) -> float:
        return float("nan") if self._lost else super().force_n

    def track(
        self, setpoints: Mapping[str, Pose], time_s: float, change_m: Floats | None = None
    ) -> TissueState:
        state = super().track(setpoints, time_s, change_m)
        self._lost = any(fault.active(time_s) for fault in self._faults)
        return replace(state, converged=False) if self._lost else state


class FaultyPlanner(Planner):
    """A planner that runs out of time while one of ``faults`` is there."""

    def __init__(self, scene: Scene, faults: Sequence[Fault], now_s: Callable[[], float]) -> None:
        super().__init__(scene)
        self._faults = tuple(faults)
        self._now_s = now_s

    def plan(
        self,
        situation: Situation,
        attached: NDArray[np.bool_],
        *,
        required_grasp: GridPoint | None = None,
        exposing: Sequence[str] | None = None,
    ) -> Plan:
        if any(fault.active(self._now_s()) for fault in self._faults):
            raise PlanningTimeout(f"no answer within {self.budget_s:g} s, as the fault file says")
        return super().plan(situation, attached, required_grasp=required_grasp, exposing=exposing)


class NodeBreaker(py_trees.visitors.VisitorBase):
    """Breaks nodes right after they were ticked.

    ``broke`` is called with a sentence before anything happens, for whoever judges the run.
    """

    def __init__(
        self,
        faults: Sequence[NodeFault],
        now_s: Callable[[], float],
        broke: Callable[[str], None],
    ) -> None:
        super().__init__(full=False)
        self._faults = tuple(faults)
        self._now_s = now_s
        self._broke = broke

    def run(self, behaviour: Behaviour) -> None:
        now_s = self._now_s()
        for fault in self._faults:
            if not (isinstance(behaviour, Node) and fault.active(now_s)):
                continue
            path = path_of(behaviour)
            if not path_matches(fault.node, path):
                continue
            self._broke(f"{path}: {fault.kind}")
            while isinstance(fault, NodeHangs):
                pass
            raise InjectedFault(f"{path} broke at {now_s:.2f} s, as the fault file says")


def path_of(behaviour: Behaviour) -> str:
    """Path of a behaviour in its tree: "defras/operate/act/4_pull_psm1"."""
    above = behaviour.parent
    return behaviour.name if above is None else f"{path_of(above)}/{behaviour.name}"


class FullDisk:
    """A recorder whose disk is full while one of ``faults`` is there."""

    def __init__(self, recorder: Recorder, faults: Sequence[DiskFull]) -> None:
        self._recorder = recorder
        self._faults = tuple(faults)
        self._now_s = 0.0

    def start(self, info: RunInfo) -> None:
        self._write()
        self._recorder.start(info)

    def tick(self, record: TickRecord) -> None:
        self._now_s = record.time_s
        self._write()
        self._recorder.tick(record)

    def finish(self, summary: RunSummary) -> None:
        self._recorder.finish(summary)

    def _write(self) -> None:
        if any(fault.active(self._now_s) for fault in self._faults):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
