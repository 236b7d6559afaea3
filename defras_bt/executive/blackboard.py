"""What the nodes of one executive share. One instance per executive; nothing is global."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isnan
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.mismatch.finding import MismatchFinding
from defras_bt.executive.ports import PortValues
from defras_bt.learning.estimate import AttachmentEstimate
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.planning.plan import GridPoint, Plan
from defras_bt.recording.operator_state import NOBODY, OperatorState
from defras_bt.recording.record import Cause, Event, Level
from defras_sim.geometry import Floats, Pose
from defras_sim.tissue.state import TissueState
from defras_sim.worlds.protocol import ArmCommand, Command, Observation

Outcome = Literal["goal", "not_reached", "human", "error"]

LONGEST_WATCH_S = 0.5
"""A tick counts for at most this much of what was watched. Where one lasted longer, the tree was
computing (it learned, it rehearsed) while a real world's time went on; no patience may run out over
what nobody looked at."""


@dataclass(frozen=True)
class TickInputs:
    """Everything known when the tree is ticked; never changed by a node.

    ``missing`` lists, in words, each reading that is absent, not a number or too old: nodes and
    gate treat any entry as a tripped guard. ``force_n`` is the largest grasp force estimated by
    the twin: 0 while nothing is held, NaN while the twin cannot say; ``force_over_s`` is how long
    it has been over its threshold or unknown without a break.
    """

    tick: int
    time_s: float
    observation: Observation
    missing: tuple[str, ...]
    twin: TissueState | None
    force_n: float
    force_threshold_n: float
    reading: MonitorReading | None
    operator: OperatorState = NOBODY
    force_over_s: float = 0.0

    @property
    def force_over(self) -> bool:
        """Whether the force is over its threshold, or either of them is not a number."""
        return not self.force_n <= self.force_threshold_n


@dataclass
class Grip:
    """What one arm holds since when. ``starts_m`` remembers where each manoeuvre began."""

    point: GridPoint
    grasp_tip: Pose
    starts_m: dict[str, Floats] = field(default_factory=dict)
    done: tuple[str, ...] = ()


@dataclass(frozen=True)
class LearningAttempt:
    """When attachments were last learned: the warning state and the tips (3,) per arm then."""

    tick: int
    warning_state: int
    tips_m: Mapping[str, Floats]


@dataclass
class Blackboard:
    """Inputs of the tick, decisions of the nodes, and what must outlive a tick.

    ``metric`` names the discrepancy whose warning state counts; None for a tree without monitoring.
    ``command`` and ``rate`` start every tick at hold and 1: a rate is always taken from its
    nominal value, never from the tick before. ``force_over_s`` is how long the force has been over
    its threshold or unknown without a break. ``watched_s`` is the world time that was watched;
    every patience is counted in it. ``unexplained``: learning last failed.
    ``posterior``: what it said of the attachments since the grasp, until somebody probed for it.
    ``mismatch``: what a diagnosis since the grasp found. ``slipped``: the first grip at each point
    that was given up for a slip.
    ``failure`` is
    what recoveries of this tick have to mend: why the plan was not carried on, or what the last
    recovery could not do.
    ``plan_belief`` (holes,) marks the attachments that the plan was made with; ``plan_exposing``
    lists the manoeuvres after which it counts on seeing the region. ``new_plan`` waits for the
    executive to put it into the tree after the tick. ``ports`` holds what leaves hand to each other
    under keys of their tree.
    """

    inputs: TickInputs
    metric: str | None = None
    command: Command = field(default_factory=Command)
    rate: float = 1.0
    events: list[Event] = field(default_factory=list)
    failure: Cause | None = None
    ports: PortValues = field(default_factory=PortValues)
    awaits_approval: bool = False

    plan: Plan | None = None
    new_plan: Plan | None = None
    plan_exposing: tuple[str, ...] = ()
    plan_belief: NDArray[np.bool_] | None = None
    no_plan: str | None = None
    preoperative_used: bool = False
    blocked: set[GridPoint] = field(default_factory=set)
    at: dict[str, GridPoint] = field(default_factory=dict)
    grips: dict[str, Grip] = field(default_factory=dict)

    rest_calibrated: bool = False
    force_over_s: float = 0.0
    watched_s: float = 0.0
    last_learning: LearningAttempt | None = None
    unexplained: bool = False
    posterior: AttachmentEstimate | None = None
    mismatch: MismatchFinding | None = None
    slipped: dict[GridPoint, Grip] = field(default_factory=dict)
    operator_refused: str | None = None
    outcome: Outcome | None = None
    outcome_cause: Cause | None = None

    def begin_tick(self, inputs: TickInputs) -> None:
        """Forget the last tick's decisions; keep what lasts."""
        passed_s = max(0.0, inputs.time_s - self.inputs.time_s)
        self.watched_s += min(passed_s, LONGEST_WATCH_S)
        self.inputs = inputs
        self.command = Command()
        self.rate = 1.0
        self.events = []
        self.failure = None
        self.awaits_approval = False

    def move(self, arm: str, command: ArmCommand) -> None:
        """Propose motion for one arm; the gate has the last word."""
        self.command = Command({**self.command.arms, arm: command})

    def tell(
        self, kind: str, sentence: str, level: Level = "info", data: Mapping[str, Any] | None = None
    ) -> None:
        """Log one sentence that a surgeon understands."""
        self.events.append(Event(self.inputs.time_s, kind, level, sentence, dict(data or {})))

    def end(self, outcome: Outcome, reason: str, code: str) -> None:
        """Decide the run's outcome; the first decision stands."""
        if self.outcome is None:
            self.outcome = outcome
            self.outcome_cause = Cause(code, reason)

    @property
    def outcome_reason(self) -> str:
        """Why the run ended, in words; "" while it goes on."""
        return self.outcome_cause.message if self.outcome_cause is not None else ""

    @property
    def visible_share(self) -> float | None:
        """Share of the region of interest that is seen; None if unknown, or any reading is old."""
        seen = self.inputs.observation.roi_visibility
        return None if seen is None or isnan(seen) or self.inputs.missing else seen

    @property
    def warning_state(self) -> int | None:
        """State of the metric that this tree listens to; None if unknown or not monitored."""
        reading = self.inputs.reading
        if reading is None or self.metric is None or isnan(reading.mu_m[self.metric]):
            return None
        return reading.warning_state[self.metric]

    @property
    def mu_m(self) -> float:
        """Discrepancy of the metric that this tree listens to; NaN if unknown or not monitored."""
        reading = self.inputs.reading
        if reading is None or self.metric is None:
            return float("nan")
        return reading.mu_m[self.metric]
