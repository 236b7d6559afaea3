"""The executive once more on what it was told: what does it decide differently, and from when on?

There is no world. Readings and the operator's answers come from the recording, in the order of the
ticks; sensing aside, everything is computed anew: twin, monitoring, learning, planning, tree.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from defras_bt.executive.again import (
    recorded_faults,
    recorded_plan,
    recorded_substitutes,
    recorded_weights,
    unpack_tree,
)
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import Operation, operate_in, random_generators
from defras_bt.executive.reasons import Code
from defras_bt.faults.faults import FaultInjection
from defras_bt.planning.plan import Plan
from defras_bt.recording.decision_reader import read_decisions
from defras_bt.recording.inputs import TickInput
from defras_bt.recording.inputs_reader import RecordedInputs, read_inputs
from defras_bt.recording.moment import Moment, moment_of
from defras_bt.recording.operator_state import OperatorState
from defras_bt.recording.record import Recorder, RunInfo, RunSummary, TickRecord
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import Command, Observation


class EndOfRecording(Exception):
    """There is nothing more that the executive was told."""


@dataclass(frozen=True)
class Difference:
    """The first tick at which the replay decides otherwise.

    ``paths`` are the nodes whose status differs, or whose words do where all statuses agree.
    """

    recorded: Moment
    replayed: Moment
    paths: tuple[str, ...]
    only_words: bool


@dataclass(frozen=True)
class Replay:
    """``ticks`` were decided once more; ``difference`` None: each exactly as before.

    ``broke`` says how the recorded run ended if it ended in an error, which is not replayed: what
    the executive was told in that tick is not known.
    """

    ticks: int
    difference: Difference | None
    broke: str | None = None


class RecordedWorld:
    """Tells what was recorded and takes commands without effect."""

    name = "recording"

    def __init__(self, ticks: tuple[TickInput, ...], tick_s: float) -> None:
        self.tick_s = tick_s
        self._ticks = ticks
        self._now = 0
        self.ended = False

    @property
    def time_s(self) -> float:
        return self.now.observation.time_s

    @property
    def now(self) -> TickInput:
        """What the tick under way was told.

        Raises:
            EndOfRecording: it was the last one.
        """
        if self.over:
            raise EndOfRecording
        return self._ticks[self._now]

    @property
    def over(self) -> bool:
        """Whether there is nothing more to tell."""
        return self.ended or self._now >= len(self._ticks)

    def observe(self) -> Observation:
        return self.now.observation

    def command(self, command: Command) -> None:
        pass

    def step(self) -> None:
        self._now += 1

    def true_force_n(self) -> float | None:
        return None

    def true_surface(self) -> Surface | None:
        return None

    def close(self) -> None:
        pass


class _RecordedOperator:
    """Wants what the operator wanted, and answers plans as they were answered."""

    def __init__(self, world: RecordedWorld, moments: Mapping[int, Moment]) -> None:
        self._world = world
        self._moments = moments

    def state(self) -> OperatorState:
        return self._world.now.operator

    def approve(self, plan: Plan) -> bool | None:
        moment = self._moments.get(self._world.now.tick)
        words = moment.nodes.values() if moment is not None else ()
        said = {word.code for word in words if word.ticked}
        return None if Code.AWAITING_APPROVAL in said else Code.PLAN_REFUSED not in said

    def idle(self) -> None:
        pass


class _Comparison:
    """A recorder that compares each tick and ends the replay at the first that differs."""

    def __init__(self, recorded: Mapping[int, Moment], world: RecordedWorld) -> None:
        self._recorded = recorded
        self._world = world
        self._kinds: Mapping[str, str] = {}
        self.ticks = 0
        self.difference: Difference | None = None

    def start(self, info: RunInfo) -> None:
        self._kinds = dict(info.tree_paths)

    def tick(self, record: TickRecord) -> None:
        if self._world.over:
            return  # told only that the recording is over
        recorded = self._recorded[record.tick]
        self.difference = _difference(recorded, moment_of(record, self._kinds))
        self._world.ended = self.difference is not None
        self.ticks += 1

    def finish(self, summary: RunSummary) -> None:
        pass


def replay(
    run: Path, tree_file: Path | None = None, recorders: tuple[Recorder, ...] = ()
) -> Replay:
    """Decide everything in the folder ``run`` once more, up to the first difference.

    ``tree_file``: another tree than the recorded one, to see what it would have decided.

    Raises:
        NoInputs: the recording does not say what the executive was told.
        InvalidDecisions: it does not say what was decided.
        InvalidFile: the tree cannot be used.
        NoWeights: the weights of its own that it was recorded with are not there any more.
        ExecutiveFailed: the replay broke.
    """
    inputs, decisions = read_inputs(run), read_decisions(run)
    moments = {moment.tick: moment for moment in decisions.moments()}
    last = moments[max(moments)] if moments else None
    broke = None
    if last is not None and last.ended is not None and last.ended.code == Code.INTERNAL_ERROR:
        broke = last.ended.message
        del moments[last.tick]
    ticks = tuple(tick for tick in inputs.ticks if tick.tick in moments)
    if not ticks:
        return Replay(0, None, broke)
    with TemporaryDirectory() as folder:
        tree = tree_file or unpack_tree(inputs.setup["again"], Path(folder))
        return _replay(inputs, ticks, tree, moments, broke, recorders)


def _replay(
    inputs: RecordedInputs,
    ticks: tuple[TickInput, ...],
    tree_file: Path,
    moments: Mapping[int, Moment],
    broke: str | None,
    recorders: tuple[Recorder, ...],
) -> Replay:
    scene = Scene.model_validate(inputs.setup["scene"])
    again, seed = inputs.setup["again"], inputs.setup["seed"]
    world = RecordedWorld(ticks, scene.tick_s)
    comparison = _Comparison(moments, world)
    operation = Operation(
        scene=scene,
        actual=scene,
        scene_file=inputs.setup["scene_file"],
        actual_file=None,
        world=world.name,
        tree_file=tree_file,
        seed=seed,
        force_threshold_n=inputs.setup["force_threshold_n"],
        preoperative=recorded_plan(again),
        max_time_s=again["max_time_s"],
        substitutes=recorded_substitutes(again, inputs.file),
        weights=recorded_weights(again),
    )

    try:
        _, learning_rng = random_generators(seed)
        operate_in(
            world,
            operation,
            learning_rng,
            (comparison, *recorders),
            operator=_RecordedOperator(world, moments),
            faults=FaultInjection(recorded_faults(again), scene, seed),
        )
    except ExecutiveFailed as error:
        if not isinstance(error.__cause__, EndOfRecording):
            raise
    return Replay(comparison.ticks, comparison.difference, broke)


def _difference(recorded: Moment, replayed: Moment) -> Difference | None:
    before, now = recorded.nodes, replayed.nodes
    # With another tree, nodes that only one of the two has are not compared; actions of plans are.
    alone = set(recorded.kinds) ^ set(replayed.kinds)
    paths = [p for p in {**before, **now} if before.get(p) != now.get(p) and p not in alone]
    statuses = [
        path
        for path in paths
        if (a := before.get(path)) is None
        or (b := now.get(path)) is None
        or (a.ticked, a.status) != (b.ticked, b.status)
    ]
    if not paths:
        return None
    return Difference(recorded, replayed, tuple(statuses or paths), only_words=not statuses)
