"""``decisions.jsonl``: what every node of the tree said at every tick, and why.

One JSON object a line. The first names the format, the tree and its nodes. Each further one is a
tick; under ``nodes`` stand only those whose words are other than in the tick before, as
``[ticked, status, code, message, decider]``, and under ``gone`` those that left the tree.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from defras_bt.recording.moment import NodeWord, node_words
from defras_bt.recording.record import Cause, RunInfo, RunSummary, TickRecord

SCHEMA = "defras/decisions/1"
DECISIONS_FILE = "decisions.jsonl"
DECISIONS_TOPIC = "/executive/decisions"
"""Strings of the same lines, where a run is recorded by others (``rosbag record``)."""


class DecisionLines:
    """The lines of a run, one after the other."""

    def __init__(self) -> None:
        self._before: dict[str, NodeWord] = {}

    def first(self, info: RunInfo) -> str:
        """The line before the first tick."""
        nodes = [list(node) for node in info.tree_paths]
        return _line({"schema": SCHEMA, "tree": info.tree, "nodes": nodes})

    def tick(self, record: TickRecord) -> str:
        """The line of the next tick."""
        now = node_words(record)
        line: dict[str, Any] = {
            "tick": record.tick,
            "time_s": record.time_s,
            "operator": record.operator.mode.value,
            "cause": _cause(record.cause),
            "stopped_by": _cause(record.stopped_by),
            "ended": _cause(record.ended),
            "nodes": _changed(self._before, now),
        }
        gone = [path for path in self._before if path not in now]
        if gone:
            line["gone"] = gone
        if record.events:
            line["events"] = [[e.kind, e.level, e.sentence] for e in record.events]
        self._before = now
        return _line(line)


class DecisionRecorder:
    """Writes ``path`` line by line: a killed process loses at most the line it was writing."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: TextIO | None = None
        self._lines = DecisionLines()

    def start(self, info: RunInfo) -> None:
        self._file = self._path.open("w", encoding="utf-8", buffering=1)
        self._file.write(self._lines.first(info) + "\n")

    def tick(self, record: TickRecord) -> None:
        if self._file is None:
            raise RuntimeError("a tick came before the start of the run: call start first")
        self._file.write(self._lines.tick(record) + "\n")

    def finish(self, summary: RunSummary) -> None:
        if self._file is not None:
            self._file.close()


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def _cause(cause: Cause | None) -> list[str] | None:
    return None if cause is None else [cause.code, cause.message, cause.path]


def _changed(before: Mapping[str, NodeWord], now: Mapping[str, NodeWord]) -> dict[str, list[Any]]:
    return {
        path: [word.ticked, word.status, word.code, word.message, word.decider]
        for path, word in now.items()
        if before.get(path) != word
    }
