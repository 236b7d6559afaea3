"""``run.json``: one run in numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from defras_bt.recording.record import Cause, RunInfo, RunSummary, TickRecord
from defras_bt.recording.run_file import Outcome, RunFile
from defras_bt.recording.whole_file import write_whole


class SummaryRecorder:
    """Counts while a run goes on, sums up when asked, and writes ``run.json`` at the end.

    The executive asks :meth:`summary` after the last tick and hands the answer to every recorder's
    ``finish``. With ``path`` None nothing is written.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._path = path
        self._info: RunInfo | None = None
        self._events = {"action": 0, "replan": 0, "learning": 0}
        self._adopted = 0
        self._warnings = [0, 0, 0, 0]
        self._state = 0
        self._reason: Cause | None = None
        self._acts: list[dict[str, object]] = []
        self._held_ticks = 0
        self._force_max_n: float | None = None
        self._force_true_max_n: float | None = None
        self._force_sum_n, self._force_ticks, self._ticks_over = 0.0, 0, 0
        self._ticks_truly_over = 0
        self._visibility: float | None = None
        self._first_s: float | None = None
        self._last_s = 0.0

    def start(self, info: RunInfo) -> None:
        self._info = info

    def tick(self, record: TickRecord) -> None:
        self._first_s = record.time_s if self._first_s is None else self._first_s
        self._last_s = record.time_s
        seen = record.observation.roi_visibility
        if seen is not None and math.isfinite(seen):
            self._visibility = seen
        self._reason = record.ended or self._reason
        self._held_ticks += record.operator.holds
        self._count_events(record)
        self._count_warnings(record)
        self._count_force(record)

    def summary(
        self, outcome: Outcome, wall_s: float, stream: Mapping[str, Any] | None = None
    ) -> RunSummary:
        """What the run came to so far; keys and meaning are those of :class:`RunFile`.

        ``stream``: how the stream of set-points to real arms went, None for simulated worlds.
        """
        info = self._started()
        file = RunFile.model_validate(
            {
                "outcome": outcome,
                "reason": self._reason
                and {"code": self._reason.code, "sentence": self._reason.message},
                "roi_visibility": self._visibility,
                "actions": self._events["action"],
                "replans": self._events["replan"],
                "warnings": {str(state): self._warnings[state] for state in (1, 2, 3)},
                "attachment_updates": {"tried": self._events["learning"], "adopted": self._adopted},
                "operator": {
                    "acts": self._acts,
                    "held_s": self._held_ticks * info.scene.tick_s,
                },
                "force_threshold_n": info.force_threshold_n,
                "force_max_n": self._force_max_n,
                "force_mean_n": self._force_sum_n / self._force_ticks
                if self._force_ticks
                else None,
                "force_max_true_n": self._force_true_max_n,
                "time_over_threshold_s": self._ticks_over * info.scene.tick_s,
                "ticks_over_threshold": self._ticks_over,
                "time_over_threshold_true_s": None
                if self._force_true_max_n is None
                else self._ticks_truly_over * info.scene.tick_s,
                "duration_s": self._last_s - (self._first_s or 0.0),
                "wall_s": wall_s,
                "seed": info.seed,
                "scene": info.scene_file,
                "actual": info.actual_file,
                "world": info.world,
                "tree": info.tree,
                "versions": dict(info.versions),
                "substituted": list(info.substituted),
                "stream": stream,
            }
        )
        return RunSummary(file.model_dump(by_alias=True))

    def finish(self, summary: RunSummary) -> None:
        if self._path is not None:
            write_run_json(self._path, summary)

    def _started(self) -> RunInfo:
        if self._info is None:
            raise RuntimeError("the summary was asked for before the run started: call start first")
        return self._info

    def _count_events(self, record: TickRecord) -> None:
        for event in record.events:
            if event.kind in self._events:
                self._events[event.kind] += 1
            if event.kind == "operator" and "act" in event.data:
                self._acts.append({"time_s": event.time_s, **event.data})
            if event.kind == "learning":
                if not isinstance(event.data.get("adopted"), bool):
                    raise ValueError(
                        f"learning event at {event.time_s} s should say data['adopted'] as true or "
                        f"false, says {dict(event.data)}"
                    )
                self._adopted += event.data["adopted"]

    def _count_warnings(self, record: TickRecord) -> None:
        state = self._started().warning_state(record.reading)
        if state is None:
            return
        if state > self._state:
            self._warnings[state] += 1
        self._state = state

    def _count_force(self, record: TickRecord) -> None:
        if math.isfinite(record.force_n):
            self._force_max_n = max(self._force_max_n or 0.0, record.force_n)
            if record.force_n > 0:
                self._force_sum_n += record.force_n
                self._force_ticks += 1
            self._ticks_over += not record.force_n <= self._started().force_threshold_n
        if record.true_force_n is not None and math.isfinite(record.true_force_n):
            self._force_true_max_n = max(self._force_true_max_n or 0.0, record.true_force_n)
            self._ticks_truly_over += record.true_force_n > self._started().force_threshold_n


def write_run_json(path: Path, summary: RunSummary) -> None:
    """Write at once or not at all, so that no reader ever sees half a file."""
    text = json.dumps(
        RunFile.model_validate(dict(summary.values)).model_dump(by_alias=True), indent=2
    )
    write_whole(path, text + "\n")


def read_run_json(path: Path) -> RunFile:
    """Read and check ``run.json``.

    Raises:
        pydantic.ValidationError: the file does not keep to the schema.
    """
    return RunFile.model_validate_json(path.read_text(encoding="utf-8"))
