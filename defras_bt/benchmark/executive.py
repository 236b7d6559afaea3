"""What the executive costs per tick, beside bare py_trees on the same tree.

Everything but world, twin and drawing counts: checks of readings, monitoring, the tree with its
reasons, the gate, and in a second run the recording. World and twin are stand-ins that cost next to
nothing, and what they cost is subtracted. The tissue hangs from a jaw that lifted it, and breathes:
cloud and twin's surface have the size and the shape of real ones and change all the time, so that
sensing and monitoring do what they do in an operation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, thread_time
from typing import Any

import numpy as np

from defras_bt.benchmark.bare_tree import BareTree, Said
from defras_bt.executive.context import Context
from defras_bt.executive.executive import Executive
from defras_bt.executive.perception import Perception
from defras_bt.executive.testing import BenchWorld, NodeBench
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.monitoring.warning import WarningMonitor
from defras_bt.planning.plan import Action, GridPoint, Plan
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.composite import CompositeRecorder
from defras_bt.recording.decisions import DECISIONS_FILE, DecisionRecorder
from defras_bt.recording.record import Recorder, RunInfo, RunSummary, TickRecord
from defras_bt.recording.summary import SummaryRecorder
from defras_bt.recording.timeline import TimelineRecorder
from defras_bt.recording.versions import versions
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.model import TissueModel
from defras_sim.tissue.state import TissueState
from defras_sim.twin import Twin
from defras_sim.worlds.protocol import Command, Observation, PointCloud

BARE = "bare py_trees"
_BREATH_M = 1e-4
_LIFT_M = 0.03
_CYCLE = ("reach", "open", "grasp", "pull", "move", "fold", "release")
_POINTS: tuple[GridPoint, ...] = ((2, 4), (2, 5), (3, 4), (3, 5), (1, 4))


class Stopwatch:
    """Adds up CPU and wall time of what it is put around."""

    def __init__(self) -> None:
        self._spent_s = np.zeros(2)
        self._since_s = (0.0, 0.0)

    def __enter__(self) -> None:
        self._since_s = (thread_time(), perf_counter())

    def __exit__(self, *_: object) -> None:
        cpu_s, wall_s = thread_time(), perf_counter()
        self._spent_s += (cpu_s - self._since_s[0], wall_s - self._since_s[1])

    def take_s(self) -> Floats:
        """CPU and wall time (2,) spent since the last call."""
        taken, self._spent_s = self._spent_s, np.zeros(2)
        return taken


Costs = Mapping[str, Floats]
"""Seconds (ticks, 2) of CPU and of wall time, by what they were spent on."""


def measure(
    tree_file: Path,
    scene: Scene,
    actions: int = 30,
    repeats: int = 5,
    progress: Callable[[], None] = lambda: None,
) -> list[dict[str, Any]]:
    """A row for each thing measured; ``progress`` is called after each of the ``repeats``.

    A plan of so many actions is carried out without and with recording, then bare. It is the same
    every time, so of each tick the least CPU time counts: that of the run in which nobody else
    emptied the processor's caches. Wall times are as they came.
    """
    runs: dict[str, list[Floats]] = {}
    for _ in range(repeats):
        for what, spent_s in _measured_once(tree_file, scene, actions).items():
            runs.setdefault(what, []).append(spent_s)
        progress()
    bare_s = np.min(runs[BARE], axis=0)[:, 0]
    return [_row(what, np.array(several_s), bare_s) for what, several_s in runs.items()]


def _measured_once(tree_file: Path, scene: Scene, actions: int) -> Costs:
    rig = _Rig(tree_file, scene, actions, ())
    plain = rig.run()
    with TemporaryDirectory() as folder:
        recorded = _Rig(tree_file, scene, actions, _recorders(Path(folder))).run()
    bare, watch, spent_s = BareTree(tree_file, rig.said), Stopwatch(), []
    for _ in rig.said:
        bare.prepare()
        with watch:
            bare.tick()
        spent_s.append(watch.take_s())
        bare.check()
    own_s = plain["whole"] - plain["world and twin"]
    writing = [name for name in recorded if name.endswith("Recorder")]
    written_s = np.sum([recorded[name] for name in writing], axis=0)
    return {
        BARE: np.array(spent_s),
        "executive": own_s,
        "executive, recording": own_s + written_s,
        "of it monitoring": plain["monitoring"],
        "of it all else": own_s - plain["monitoring"],
        **{name: recorded[name] for name in writing},
    }


def _row(what: str, several_s: Floats, bare_s: Floats) -> dict[str, Any]:
    """``several_s`` (repeats, ticks, 2) of CPU and wall time; ``bare_s`` (ticks,) of CPU."""
    least_s, wall_s = several_s[:, :, 0].min(axis=0), several_s[:, :, 1]
    median, p99 = np.quantile(least_s, (0.5, 0.99))
    bare_median, bare_p99 = np.quantile(bare_s, (0.5, 0.99))
    return {
        "per tick": what,
        "ticks": len(least_s),
        "CPU median ms": round(1e3 * float(median), 3),
        "CPU p99 ms": round(1e3 * float(p99), 3),
        "wall median ms": round(1e3 * float(np.median(wall_s)), 3),
        "wall p99 ms": round(1e3 * float(np.quantile(wall_s, 0.99)), 3),
        "median / bare": round(float(median / bare_median), 1),
        "p99 / bare": round(float(p99 / bare_p99), 1),
    }


def plan_of_length(actions: int) -> Plan:
    """Retractions one after the other, up to so many actions."""
    steps = [
        Action(name, "psm1", _POINTS[step // len(_CYCLE) % len(_POINTS)], step + 1)
        for step, name in zip(range(actions), _CYCLE * (actions // len(_CYCLE) + 1), strict=False)
    ]
    return Plan(tuple(steps), source="preoperative")


class _Rig:
    """An executive with stand-ins for world and twin, each with a stopwatch around it."""

    def __init__(
        self, tree_file: Path, scene: Scene, actions: int, recorders: Sequence[Recorder]
    ) -> None:
        self._outside, self._monitoring = Stopwatch(), Stopwatch()
        self._recording = {type(recorder).__name__: Stopwatch() for recorder in recorders}
        bench = NodeBench(scene=scene, preoperative=plan_of_length(actions))
        twin = _TimedTwin(scene, self._outside)
        world = _TimedWorld(scene, twin.state.surface, self._outside)
        monitor = _TimedMonitor(scene, self._monitoring)
        context: Context = replace(bench.context, twin=twin, monitor=monitor)
        perception = Perception(bench.board, twin, monitor, bench.keyframes, 1.0)
        self._notes = _Notes()
        timed = [_TimedRecorder(r, self._recording[type(r).__name__]) for r in recorders]
        self._recorder = CompositeRecorder([self._notes, *timed])
        self._executive = Executive(
            tree_file, context, world, perception, self._recorder, max_time_s=600.0
        )
        monitor.listen_to(self._executive.tree.metric)
        self._board = bench.board
        self._recorder.start(_info(scene, self._executive))

    def run(self) -> Costs:
        """Tick until the plan is done."""
        whole, slot = Stopwatch(), self._executive.tree.plan_slot
        if slot is None:
            raise ValueError(f"tree {self._executive.tree.name} has no plan_slot")
        watches = {
            "whole": whole,
            "world and twin": self._outside,
            "monitoring": self._monitoring,
            **self._recording,
        }
        spent_s: dict[str, list[Floats]] = {name: [] for name in watches}
        while self._board.outcome is None and slot.code != "plan_finished":
            with whole:
                self._executive.tick()
            for name, watch in watches.items():
                spent_s[name].append(watch.take_s())
        self._recorder.finish(RunSummary({}))
        return {name: np.array(values) for name, values in spent_s.items()}

    @property
    def said(self) -> list[Said]:
        """What the nodes said, tick by tick."""
        return self._notes.said


class _TimedWorld(BenchWorld):
    """Arms that move as told over resting tissue, seen at the camera's own pace with its noise."""

    def __init__(self, scene: Scene, surface: Surface, watch: Stopwatch) -> None:
        super().__init__(scene)
        self._watch = watch
        self._rng = np.random.default_rng(0)
        self._noise_m = scene.depth_camera.noise_sd_m
        camera = scene.depth_camera.model_copy(update={"noise_sd_m": 0.0})
        self._points_m = depth_cloud_m(camera, surface, RayCaster(surface), self._rng)
        self._every = max(1, round(scene.depth_camera.period_s / scene.tick_s))
        self._seen = PointCloud(0.0, self._points_m)

    def observe(self) -> Observation:
        with self._watch:
            if self.ticks % self._every == 0 and self._seen.stamp_s != self.time_s:
                noise = self._noise_m * self._rng.standard_normal(self._points_m.shape)
                self._seen = PointCloud(self.time_s, self._points_m + noise)
            return replace(super().observe(), cloud=self._seen)

    def command(self, command: Command) -> None:
        with self._watch:
            super().command(command)

    def step(self) -> None:
        with self._watch:
            super().step()


class _TimedTwin(Twin):
    """A twin whose lifted tissue breathes a little, whatever is done to it.

    So no tick finds the surface of the one before, as while tissue is held.
    """

    def __init__(self, scene: Scene, watch: Stopwatch) -> None:
        super().__init__(scene)
        self._watch = watch
        self._lifted = _lifted(scene)

    @property
    def state(self) -> TissueState:
        """The same at all times but for its breath."""
        return self._lifted

    def grasp(self, arm: str, tissue_from_tip: Pose, time_s: float | None = None) -> None:
        pass

    def release(self, arm: str, time_s: float | None = None) -> None:
        pass

    def track(
        self, setpoints: Mapping[str, Pose], time_s: float, change_m: Floats | None = None
    ) -> TissueState:
        with self._watch:
            surface = self.state.surface
            risen_m = surface.vertices_m + [0.0, 0.0, _BREATH_M * np.sin(time_s)]
            return replace(self.state, surface=replace(surface, vertices_m=risen_m))


def _lifted(scene: Scene) -> TissueState:
    """Tissue that is held at the first point of the plan, well above where it lay."""
    tissue = TissueModel(scene)
    grasp = Pose(scene.grasp_point_m(*_POINTS[0]))
    tissue.grasp("psm1", grasp)
    for share in np.linspace(0.1, 1.0, 10):
        state = tissue.solve({"psm1": grasp.moved(np.array([0.0, 0.0, share * _LIFT_M]))})
    return state


class _TimedMonitor(WarningMonitor):
    def __init__(self, scene: Scene, watch: Stopwatch) -> None:
        super().__init__(scene)
        self._watch = watch

    def observe_rest(self, cloud: PointCloud | None, surface: Surface) -> bool:
        with self._watch:
            return super().observe_rest(cloud, surface)

    def reading(self, cloud: PointCloud | None, surface: Surface, time_s: float) -> MonitorReading:
        with self._watch:
            return super().reading(cloud, surface, time_s)


class _TimedRecorder:
    def __init__(self, recorder: Recorder, watch: Stopwatch) -> None:
        self._recorder = recorder
        self._watch = watch

    def start(self, info: RunInfo) -> None:
        self._recorder.start(info)

    def tick(self, record: TickRecord) -> None:
        with self._watch:
            self._recorder.tick(record)

    def finish(self, summary: RunSummary) -> None:
        self._recorder.finish(summary)


class _Notes:
    """Keeps what the nodes said, for the bare tree to say the same.

    Nothing else: an executive lets observations go, and the memory of a tick serves the next.
    """

    def __init__(self) -> None:
        self.said: list[Said] = []

    def start(self, info: RunInfo) -> None: ...

    def tick(self, record: TickRecord) -> None:
        self.said.append(Said(record.node_status, record.plan))

    def finish(self, summary: RunSummary) -> None: ...


def _recorders(folder: Path) -> list[Recorder]:
    """Those that write while a run lasts; the report draws at its end."""
    return [
        TimelineRecorder(folder / "run.rrd"),
        BagRecorder(folder / "recording.mcap"),
        DecisionRecorder(folder / DECISIONS_FILE),
        SummaryRecorder(),
    ]


def _info(scene: Scene, executive: Executive) -> RunInfo:
    return RunInfo(
        scene=scene,
        scene_file=scene.name,
        actual=None,
        actual_file=None,
        world="bench",
        tree=executive.tree.name,
        seed=0,
        metric=executive.tree.metric,
        force_threshold_n=1.0,
        tree_paths=executive.tree.kinds(),
        versions=versions(),
        believed=scene.attached,
    )
