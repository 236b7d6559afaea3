"""A bench on which one node, or one tree, is ticked by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from defras_bt.executive.blackboard import Blackboard, Grip, TickInputs
from defras_bt.executive.context import Context
from defras_bt.executive.grips import GripTracker
from defras_bt.executive.node import Node
from defras_bt.executive.reasons import ReasonCode
from defras_bt.executive.scripted import Script, ScriptedLeaf, StatusName
from defras_bt.executive.testing.services import (
    MU_M,
    BenchEstimator,
    BenchMismatch,
    BenchMonitor,
    BenchPlanner,
    BenchProbe,
    BenchRehearsal,
    BenchTwin,
    flat_state,
)
from defras_bt.executive.testing.world import BenchWorld, bench_scene
from defras_bt.learning.buffer import KeyframeBuffer
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.planning.plan import GridPoint, Plan
from defras_bt.recording.record import Cause
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmCommand

EPSILON_N = 0.3


@dataclass
class NodeBench:
    """A world, its services, and one blackboard.

    ``says`` overrides fields of :class:`TickInputs` in the next ticks. The services are attributes:
    ``world``, ``twin``, ``monitor``, ``planner``, ``estimator``, ``mismatch``, ``keyframes``,
    ``rehearse``, ``probe``;
    change them between two ticks. ``board`` and ``context`` are what nodes are given.
    """

    preoperative: Plan | None = None
    approve: Callable[[Plan], bool] = lambda plan: True
    says: dict[str, Any] = field(default_factory=dict)
    scene: Scene = field(default_factory=bench_scene)

    def __post_init__(self) -> None:
        self.world = BenchWorld(self.scene)
        self.twin = BenchTwin(self.scene)
        self.monitor = BenchMonitor()
        self.planner = BenchPlanner()
        self.estimator = BenchEstimator(self.scene)
        self.mismatch = BenchMismatch()
        self.keyframes = KeyframeBuffer()
        self.rehearse = BenchRehearsal()
        self.probe = BenchProbe()
        self.failure: Cause | None = None
        self.board = Blackboard(self._inputs(), metric="local")
        self.grip_tracker = GripTracker(self.board, self.twin)
        self.context = Context(
            board=self.board,
            twin=self.twin,
            monitor=self.monitor,
            planner=self.planner,
            estimator=lambda name: self.estimator,
            mismatch=self.mismatch,
            keyframes=self.keyframes,
            rehearse=self.rehearse,
            probe=self.probe,
            rng=np.random.default_rng(0),
            preoperative=self.preoperative,
            approve=self.approve,
        )

    def node(self, node_class: type[Node], **parameters: Any) -> Node:
        """A leaf as a tree file with these parameters would make it.

        Raises:
            pydantic.ValidationError: a tree file could not say so.
        """
        options = node_class.Parameters.model_validate(parameters)
        return node_class(node_class.__name__, self.context, options)

    def scripted(self, name: str, *statuses: StatusName) -> ScriptedLeaf:
        """A leaf that says these statuses, one a tick; the last one stays."""
        return ScriptedLeaf(name, self.context, Script.of(*statuses))

    def warn(self, state: int | None, mu_m: float | None = None) -> None:
        """Both metrics are in ``state`` from now on; None: monitoring says nothing."""
        if state is None:
            self.says["reading"] = None
            return
        mu = dict.fromkeys(("local", "median"), MU_M[state] if mu_m is None else mu_m)
        self.says["reading"] = MonitorReading(0.0, mu, dict.fromkeys(mu, state))

    def fails(self, code: ReasonCode, message: str = "something failed") -> None:
        """In the next ticks, recoveries find that this has failed."""
        self.failure = Cause(code, message)

    def tick(self, node: Behaviour) -> Status:
        """Sense, tick ``node``, carry out what it proposes, and let the time of a tick pass."""
        self.grip_tracker.update(self.world.observe())
        self.board.begin_tick(self._inputs())
        self.board.failure = self.failure
        node.tick_once()
        self.world.command(self.board.command)
        self.world.step()
        return node.status

    def ticks(self, node: Behaviour, count: int) -> list[str]:
        """What ``node`` shows in the next ``count`` ticks."""
        return [self.tick(node).name for _ in range(count)]

    def run(self, node: Behaviour, most_s: float = 10.0) -> Status:
        """Tick ``node`` until it ends.

        Raises:
            AssertionError: it still runs after ``most_s`` of world time.
        """
        end_s = self.world.time_s + most_s
        while self.world.time_s < end_s:
            if self.tick(node) != Status.RUNNING:
                return node.status
        code = getattr(node, "code", node.status.name)
        raise AssertionError(f"still {code} after {most_s} s: {node.feedback_message}")

    def tip_m(self, arm: str = "psm1") -> Floats:
        """Where the tip of ``arm`` is (3,), tissue frame."""
        return self.world.tools[arm].tissue_from_tip.position_m

    def put(self, arm: str, tip_m: ArrayLike, jaw_rad: float | None = None) -> None:
        """Place a tip, and its jaw, by hand."""
        tool = self.world.tools[arm]
        tool.tissue_from_tip = Pose(np.asarray(tip_m, float), tool.tissue_from_tip.rotation)
        if jaw_rad is not None:
            tool.step(ArmCommand(jaw_rad=jaw_rad), 1.0, lambda tip: False)

    def hold(self, point: GridPoint = (2, 4), arm: str = "psm1", done: Sequence[str] = ()) -> Grip:
        """Let ``arm`` hold the tissue at ``point``, its tip still there."""
        tip_m = np.array([*self.scene.grasp_xy_m(*point), 0.0])
        self.put(arm, tip_m, jaw_rad=0.15)
        self.world.tools[arm].grasped = True
        self.board.at[arm] = point
        self.grip_tracker.update(self.world.observe())
        grip = self.board.grips[arm]
        grip.done = tuple(done)
        return grip

    def commanded_m_s(self, arm: str = "psm1") -> Floats:
        """Velocity (3,) that the last tick asked of ``arm``."""
        return self.world.sent[-1].arms.get(arm, ArmCommand()).linear_m_s

    def commanded_jaw_rad(self, arm: str = "psm1") -> float | None:
        """Angle at which the last tick asked the jaw of ``arm`` to be; None: to stay."""
        return self.world.sent[-1].arms.get(arm, ArmCommand()).jaw_rad

    def told(self, kind: str) -> list[str]:
        """Sentences of this kind told in the last tick."""
        return [event.sentence for event in self.board.events if event.kind == kind]

    def _inputs(self) -> TickInputs:
        plain = TickInputs(
            tick=self.world.ticks,
            time_s=self.world.time_s,
            observation=self.world.observe(),
            missing=(),
            twin=flat_state(),
            force_n=0.0,
            force_threshold_n=EPSILON_N,
            reading=MonitorReading(
                self.world.time_s, {"local": 0.0005, "median": 0.0002}, {"local": 0, "median": 0}
            ),
        )
        return replace(plain, **self.says)
