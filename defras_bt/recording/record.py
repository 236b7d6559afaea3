"""What the executive hands to everything that records or shows a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.reading import MonitorReading
from defras_bt.planning.plan import Action, Plan
from defras_bt.recording.operator_state import NOBODY, OperatorState
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.state import TissueState
from defras_sim.worlds.protocol import Command, Observation

Level = Literal["info", "warning", "error"]


@dataclass(frozen=True)
class Event:
    """Something worth telling: a sentence that a surgeon understands, and a kind for counting.

    Kinds: start, plan, action, warning, force, learning, replan, operator, why, goal, human,
    error, hold, end.
    One event of kind ``action`` is one action finished, of kind ``replan`` one new plan asked for,
    of kind ``learning`` one attachment update tried. ``data`` holds what a program counts or
    draws: ``learning`` says ``{"adopted": bool}``, ``why`` ``{"chain": [sentence, ...]}``:
    how the tree came to its decision, node by node.
    """

    time_s: float
    kind: str
    level: Level
    sentence: str
    data: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Cause:
    """Why something is as it is: a code for programs, a sentence for people, and who said so.

    ``path`` is that of the leaf in its tree ("defras/operate/force_accepted"); "" while unknown.
    """

    code: str
    message: str
    path: str = ""


@dataclass(frozen=True)
class TickRecord:
    """One tick as it happened. ``observation`` is after sensing: cloud and visibility filled in.

    ``force_n``: largest grasp force estimated by the twin, NaN while unknown; ``true_force_n`` None
    where the world has none. ``true_surface`` only for pictures. ``node_status`` maps each tree
    path ("defras/operate/act") to SUCCESS, FAILURE, RUNNING or "" where it was not ticked;
    ``node_message`` to its last word, ``node_code`` to the code of it, ``node_last_status`` to the
    last status it had, and ``node_decider`` to the child that decided it. ``cause`` is the leaf
    that decided the whole tree; ``stopped_by`` the one because of which no plan is carried out,
    None while one is, or where nobody asked. ``ended`` is why the run ended with this tick, None
    while it goes on. ``operator`` is what the operator wanted. ``sent`` left the gate;
    ``proposed`` came from the tree. ``believed`` (holes,) marks the attachments believed now.
    ``plan`` is the latest plan, ``plan_step`` the 0-based index of the action in it that is carried
    out, None while none is.
    """

    tick: int
    time_s: float
    observation: Observation
    twin: TissueState | None
    reading: MonitorReading | None
    force_n: float
    true_force_n: float | None
    true_surface: Surface | None
    rate: float
    proposed: Command
    sent: Command
    believed: NDArray[np.bool_]
    node_status: Mapping[str, str]
    node_message: Mapping[str, str]
    plan: Plan | None
    plan_step: int | None
    events: tuple[Event, ...] = ()
    node_code: Mapping[str, str] = field(default_factory=dict)
    node_last_status: Mapping[str, str] = field(default_factory=dict)
    node_decider: Mapping[str, str] = field(default_factory=dict)
    cause: Cause | None = None
    stopped_by: Cause | None = None
    ended: Cause | None = None
    operator: OperatorState = NOBODY

    @property
    def action(self) -> Action | None:
        """What is carried out; None while no action is."""
        if self.plan is None or self.plan_step is None:
            return None
        return self.plan.actions[self.plan_step]


@dataclass(frozen=True)
class RunInfo:
    """What is known of a run before its first tick.

    ``tree_paths`` lists (path, kind) of every node at the start. ``actual`` is None where nobody
    knows it. ``metric`` is None for a tree without monitoring. ``versions``: package to version.
    ``substituted`` lists the paths of nodes that only say what a script tells them.
    ``again`` holds, as plain values, what else is needed to decide everything once more.
    """

    scene: Scene
    scene_file: str
    actual: Scene | None
    actual_file: str | None
    world: str
    tree: str
    seed: int
    metric: str | None
    force_threshold_n: float
    tree_paths: tuple[tuple[str, str], ...]
    versions: Mapping[str, str]
    believed: NDArray[np.bool_]
    substituted: tuple[str, ...] = ()
    again: Mapping[str, Any] = field(default_factory=dict)

    def warning_state(self, reading: MonitorReading | None) -> int | None:
        """The state that the run's tree listens to; None if it has none, or nothing was read."""
        if reading is None or self.metric is None:
            return None
        return reading.warning_state.get(self.metric)


@dataclass(frozen=True)
class RunSummary:
    """The content of run.json; keys as in the documentation of recordings."""

    values: Mapping[str, Any]


class Recorder(Protocol):
    """Receives a run tick by tick; what it received so far stays readable whatever happens."""

    def start(self, info: RunInfo) -> None: ...

    def tick(self, record: TickRecord) -> None: ...

    def finish(self, summary: RunSummary) -> None:
        """Called once, after the last tick or after a failure."""
