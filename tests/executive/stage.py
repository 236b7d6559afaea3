"""A whole executive on the bench: real tree, gate and perception; world and services as told."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from defras_bt.executive.deadline import Deadline
from defras_bt.executive.executive import Executive
from defras_bt.executive.operator_desk import OperatorDesk
from defras_bt.executive.perception import Perception
from defras_bt.executive.substitution import NOTHING_SUBSTITUTED, Substitutes
from defras_bt.executive.testing import EPSILON_N, NodeBench
from defras_bt.recording.composite import CompositeRecorder
from defras_bt.recording.operator_state import Act
from defras_bt.recording.record import Recorder, RunInfo, RunSummary, TickRecord
from defras_sim.resources import resource

FORCE_TOO_HIGH_N = 2 * EPSILON_N


class Notes:
    """A recorder that keeps everything."""

    def __init__(self) -> None:
        self.started: RunInfo | None = None
        self.records: list[TickRecord] = []
        self.finished: RunSummary | None = None

    def start(self, info: RunInfo) -> None:
        self.started = info

    def tick(self, record: TickRecord) -> None:
        self.records.append(record)

    def finish(self, summary: RunSummary) -> None:
        self.finished = summary

    def told(self, kind: str) -> list[str]:
        """Every sentence of this kind, in order."""
        return [e.sentence for record in self.records for e in record.events if e.kind == kind]


class Stage:
    """Ticks an executive one tick at a time, so that a test can change the world in between."""

    def __init__(
        self,
        tree: str | Path,
        bench: NodeBench | None = None,
        *,
        max_time_s: float = 120.0,
        beside: Sequence[Recorder] = (),
        deadline: Deadline = nullcontext,
        substitutes: Substitutes = NOTHING_SUBSTITUTED,
    ) -> None:
        self.bench = bench if bench is not None else NodeBench()
        self.desk = OperatorDesk()
        self.notes = Notes()
        self.recorder = CompositeRecorder([self.notes, *beside])
        bench = self.bench
        perception = Perception(
            bench.board,
            bench.twin,
            bench.monitor,
            bench.keyframes,
            EPSILON_N,
        )
        file = tree if isinstance(tree, Path) else resource(f"trees/{tree}.yaml")
        self.executive = Executive(
            file,
            bench.context,
            bench.world,
            perception,
            self.recorder,
            max_time_s,
            deadline,
            substitutes,
            self.desk,
        )

    @property
    def board(self):
        return self.bench.board

    @property
    def slot(self):
        return self.executive.tree.plan_slot

    def operator(self, act: Act, words: str = "") -> None:
        """The operator does this; it must be possible."""
        answer = self.desk.request(act, "test", words)
        assert answer.accepted, answer.sentence

    def warn(self, state: int) -> None:
        """The metric that the tree listens to is in ``state``; the other one stays quiet."""
        self.bench.monitor.warn(0)
        self.bench.monitor.warn(state, self.executive.tree.metric or "local")

    def tick(self) -> TickRecord:
        self.executive.tick()
        return self.notes.records[-1]

    def ticks(self, seconds: float) -> list[TickRecord]:
        """The records of the next ``seconds``; ends early with the run."""
        records = []
        for _ in range(round(seconds / self.bench.scene.tick_s)):
            if self.board.outcome is not None:
                break
            records.append(self.tick())
        return records

    def until(
        self, what: str, condition: Callable[[TickRecord], bool], most_s: float = 30.0
    ) -> TickRecord:
        """Tick until ``condition`` holds of the record; ``what`` says it in words."""
        for record in self._going(most_s):
            if condition(record):
                return record
        raise AssertionError(f"no tick where {what}; {self.where()}")

    def until_doing(self, action: str, most_s: float = 30.0) -> TickRecord:
        """Tick until an action leaf of this name moved something."""
        return self.until(
            f"{action} moves",
            lambda r: doing(r) == action and any(moving(r).values()),
            most_s,
        )

    def until_over(self, most_s: float = 60.0) -> str:
        """Tick until there is an outcome."""
        self.until("the run ends", lambda r: self.board.outcome is not None, most_s)
        assert self.board.outcome is not None
        return self.board.outcome

    def where(self) -> str:
        """What the last tick looked like, for a failing test."""
        last = self.notes.records[-1]
        lines = [
            f"{path}: {status} {last.node_message[path]}"
            for path, status in last.node_status.items()
            if status
        ]
        return "\n".join([f"at {last.time_s:.2f} s, outcome {self.board.outcome}", *lines])

    def _going(self, most_s: float):
        for _ in range(round(most_s / self.bench.scene.tick_s)):
            if self.board.outcome is not None:
                return
            yield self.tick()


def leaves(record: TickRecord) -> dict[str, str]:
    """Status by the last part of the path, of what was ticked."""
    return {
        path.rpartition("/")[2]: status for path, status in record.node_status.items() if status
    }


def doing(record: TickRecord) -> str | None:
    """Name of the action whose leaf was running, "pull" for "4_pull_psm1"; None without one."""
    running = [
        name.split("_")[1]
        for name, status in leaves(record).items()
        if status == "RUNNING" and name[0].isdigit()
    ]
    return running[0] if running else None


def moving(record: TickRecord) -> dict[str, float]:
    """Speed [m/s] that was sent, by arm."""
    return {arm: float(np.linalg.norm(c.linear_m_s)) for arm, c in record.sent.arms.items()}


def still(record: TickRecord) -> bool:
    """Whether no tip was sent anywhere."""
    return not any(moving(record).values())


def jaws(record: TickRecord) -> dict[str, float]:
    """Jaw goals that were sent."""
    return {arm: c.jaw_rad for arm, c in record.sent.arms.items() if c.jaw_rad is not None}


def told(records: Sequence[TickRecord], kind: str) -> list[str]:
    return [event.sentence for record in records for event in record.events if event.kind == kind]
