"""One operation from files to outcome: everything is put together here, and nowhere else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np

from defras_bt.diagnosis.mismatch.ranking import MismatchRanking
from defras_bt.executive.again import again_values
from defras_bt.executive.blackboard import Blackboard, TickInputs
from defras_bt.executive.context import Context
from defras_bt.executive.deadline import Deadline
from defras_bt.executive.executive import Executive
from defras_bt.executive.perception import Perception
from defras_bt.executive.substitution import NOTHING_SUBSTITUTED, Substitutes
from defras_bt.faults.faults import NO_FAULTS, FaultInjection, Faults
from defras_bt.learning.buffer import KeyframeBuffer
from defras_bt.learning.chain.estimators import estimator
from defras_bt.learning.networks.own_weights import OwnWeights
from defras_bt.learning.probe.choice import ProbeChooser
from defras_bt.monitoring.warning import WarningMonitor
from defras_bt.planning.plan import Plan
from defras_bt.recording.composite import CompositeRecorder
from defras_bt.recording.operator_state import UNATTENDED, Operator
from defras_bt.recording.record import Recorder, RunInfo, RunSummary
from defras_bt.recording.summary import SummaryRecorder
from defras_bt.recording.versions import versions
from defras_sim.retraction import GraspPoint, Rehearsal, Rehearser
from defras_sim.scene import Scene
from defras_sim.worlds.model_world import ModelWorld
from defras_sim.worlds.protocol import StreamsSetpoints, World

SIMULATED_WORLDS = ("model", "bullet")
WORLDS = SIMULATED_WORLDS
ROBOT_WORLD = "dvrk"
"""Not made here: a robot is connected to by who knows the laboratory."""


@dataclass(frozen=True)
class Operation:
    """What to run. ``scene`` is believed, ``actual`` is there, None where nobody knows it; the
    files are for the record.

    ``substitutes`` replace nodes of the tree, for trials in simulated worlds. ``weights`` of
    networks stand in for the shipped ones.
    """

    scene: Scene
    actual: Scene | None
    scene_file: str
    actual_file: str | None
    world: str
    tree_file: Path
    seed: int
    force_threshold_n: float
    preoperative: Plan | None = None
    max_time_s: float = 300.0
    substitutes: Substitutes = NOTHING_SUBSTITUTED
    weights: OwnWeights | None = None


class TwinRehearsal:
    """Rehearses on the twin's tissue as believed now; stops where the region is exposed."""

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._rehearser: Rehearser | None = None

    def __call__(self, scene: Scene, point: GraspPoint, manoeuvres: Sequence[str]) -> Rehearsal:
        if self._rehearser is None or scene is not self._scene:
            self._rehearser = Rehearser(scene, step_m=0.004, stop_when_exposed=True)
            self._scene = scene
        return self._rehearser.run(point, manoeuvres)


def operate(
    operation: Operation,
    recorders: Sequence[Recorder] = (),
    *,
    operator: Operator = UNATTENDED,
    faults: FaultInjection | None = None,
    deadline: Deadline = nullcontext,
    finishing: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> RunSummary:
    """Run the operation to its outcome; recorders that were started are finished in any case.

    ``operator`` is asked every tick. ``faults`` go wrong on the way. ``deadline`` limits how long a
    tick may take on the wall. ``finishing`` surrounds the finishing of the recorders, which nobody
    should interrupt.

    Raises:
        ValueError: nodes are substituted in a world that is not simulated.
        ExecutiveFailed: something broke; the recorders were finished first.
        RecordingFailed: the run ended, but a recorder could not keep up.
    """
    if operation.substitutes.entries and operation.world not in SIMULATED_WORLDS:
        raise ValueError(f"nodes can be substituted in {', '.join(SIMULATED_WORLDS)} only")
    if operation.actual is None:
        raise ValueError("a simulated world needs to know what is really there")
    world_rng, learning_rng = random_generators(operation.seed)
    believed = operation.scene.for_bullet() if operation.world == "bullet" else operation.scene
    world = make_world(operation.world, operation.actual, world_rng)
    return operate_in(
        world,
        replace(operation, scene=believed),
        learning_rng,
        recorders,
        operator=operator,
        faults=faults,
        deadline=deadline,
        finishing=finishing,
    )


def operate_in(
    world: World,
    operation: Operation,
    learning_rng: np.random.Generator,
    recorders: Sequence[Recorder] = (),
    *,
    operator: Operator = UNATTENDED,
    faults: FaultInjection | None = None,
    deadline: Deadline = nullcontext,
    finishing: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> RunSummary:
    """As :func:`operate`, in a world that is there already; it is closed at the end.

    ``operation.scene`` is what the twin believes, to the last detail.
    """
    started = perf_counter()
    believed = operation.scene
    try:
        injected = faults or FaultInjection(NO_FAULTS, believed, operation.seed)
        world = injected.world(world)
        summary_recorder = SummaryRecorder()
        recorder = CompositeRecorder([summary_recorder, *injected.recorders(recorders)])
        twin = injected.twin(believed)
        monitor = WarningMonitor(believed)
        keyframes = KeyframeBuffer()
        board = Blackboard(_before_first_tick(world, operation.force_threshold_n))
        context = Context(
            board=board,
            twin=twin,
            monitor=monitor,
            planner=injected.planner(believed),
            estimator=partial(estimator, own=operation.weights),
            mismatch=MismatchRanking(),
            keyframes=keyframes,
            rehearse=TwinRehearsal(),
            probe=ProbeChooser(),
            rng=learning_rng,
            preoperative=operation.preoperative,
            approve=operator.approve,
        )
        perception = Perception(board, twin, monitor, keyframes, operation.force_threshold_n)
        executive = Executive(
            operation.tree_file,
            context,
            world,
            perception,
            recorder,
            operation.max_time_s,
            deadline,
            substitutes=operation.substitutes,
            operator=operator,
        )
        monitor.listen_to(executive.tree.metric)
        breaker = injected.breaker()
        if breaker is not None:
            executive.watch(breaker)
        info = _info(operation, executive, believed, injected.faults)
        try:
            recorder.start(info)
            executive.run()
        finally:
            with finishing():
                wall_s = perf_counter() - started
                outcome = board.outcome or "error"
                summary = RunSummary({"outcome": outcome})
                try:
                    stream = world.stream_values() if isinstance(world, StreamsSetpoints) else None
                    summary = summary_recorder.summary(outcome, wall_s, stream)
                finally:
                    # Without its numbers too, what was recorded is closed properly.
                    recorder.finish(summary)
    finally:
        world.close()
    return summary


def random_generators(seed: int) -> tuple[np.random.Generator, np.random.Generator]:
    """Independent generators for the world and for learning."""
    world_rng, learning_rng = np.random.default_rng(seed).spawn(2)
    return world_rng, learning_rng


def make_world(name: str, actual: Scene, rng: np.random.Generator) -> World:
    """The world called ``name`` with the patient as it really is.

    Raises:
        ValueError: there is no such world.
    """
    if name == "model":
        return ModelWorld(actual, rng)
    if name == "bullet":
        # PyBullet is large and loads slowly; commands that need no such world do without it.
        from defras_sim.worlds.bullet_world import BulletWorld

        return BulletWorld(actual, rng)
    raise ValueError(f"there is no world {name!r}; there are: {', '.join(WORLDS)}")


def _before_first_tick(world: World, force_threshold_n: float) -> TickInputs:
    observation = world.observe()
    return TickInputs(
        tick=-1,
        time_s=observation.time_s,
        observation=observation,
        missing=("nothing was sensed yet",),
        twin=None,
        force_n=float("nan"),
        force_threshold_n=force_threshold_n,
        reading=None,
    )


def _info(operation: Operation, executive: Executive, believed: Scene, faults: Faults) -> RunInfo:
    return RunInfo(
        scene=believed,
        scene_file=operation.scene_file,
        actual=operation.actual,
        actual_file=operation.actual_file,
        world=operation.world,
        tree=executive.tree.name,
        seed=operation.seed,
        metric=executive.tree.metric,
        force_threshold_n=operation.force_threshold_n,
        tree_paths=executive.tree.kinds(),
        versions=versions(),
        believed=believed.attached,
        substituted=executive.substituted,
        again=again_values(operation, faults),
    )
