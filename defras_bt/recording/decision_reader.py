"""``decisions.jsonl`` back: any tick of a run, and those at which something was decided."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from defras_bt.recording.bag_reader import read_bag
from defras_bt.recording.decisions import DECISIONS_FILE, DECISIONS_TOPIC, SCHEMA
from defras_bt.recording.moment import Moment, NodeWord
from defras_bt.recording.record import Cause, Event

_BAGS = (".bag", ".mcap")


class InvalidDecisions(ValueError):
    """A file that is no record of decisions; the message says where and what would be valid."""


@dataclass(frozen=True)
class Decisions:
    """A recorded run. ``lines`` are its ticks as written, in order."""

    path: Path
    tree: str
    kinds: Mapping[str, str]
    lines: Sequence[Mapping[str, Any]]

    def moments(self) -> Iterator[Moment]:
        """Every tick with the words of all nodes."""
        nodes: dict[str, NodeWord] = {}
        for number, line in enumerate(self.lines, 2):
            try:
                yield _moment(line, nodes, self.kinds)
            except (KeyError, TypeError, ValueError) as error:
                raise InvalidDecisions(
                    f"{self.path}:{number}: no tick of a run ({type(error).__name__}: {error})"
                ) from error

    def at(self, tick: int) -> Moment:
        """The moment of tick number ``tick``.

        Raises:
            InvalidDecisions: the run has no such tick; the message says which it has.
        """
        for moment in self.moments():
            if moment.tick == tick:
                return moment
        last = self.lines[-1]["tick"] if self.lines else None
        valid = "none" if last is None else f"{self.lines[0]['tick']} to {last}"
        raise InvalidDecisions(f"{self.path}: there is no tick {tick}; valid: {valid}")

    def last(self) -> Moment:
        """The last moment of the run.

        Raises:
            InvalidDecisions: the run ended before its first tick.
        """
        if not self.lines:
            raise InvalidDecisions(f"{self.path}: the run ended before its first tick")
        return deque(self.moments(), maxlen=1).pop()

    def turning_points(self) -> list[Moment]:
        """Ticks at which another leaf, or the same for another reason, decided than before."""
        turns, before = [], None
        for moment in self.moments():
            now = (_who(moment.cause), _who(moment.stopped_by), moment.operator)
            if now != before or moment.events:
                turns.append(moment)
            before = now
        return turns


def read_decisions(run: Path) -> Decisions:
    """Read a run's folder, its decisions.jsonl, or a bag that others recorded of the run.

    A last line that was cut off is left out.

    Raises:
        InvalidDecisions: it is not there, or not what this program writes.
    """
    path = run / DECISIONS_FILE if run.is_dir() else run
    text = _of_bag(path) if path.suffix in _BAGS else _of_file(path)
    # What follows the last line's end was being written when the process died.
    lines = [_object(path, n, line) for n, line in enumerate(text.split("\n")[:-1], 1)]
    if not lines or lines[0].get("schema") != SCHEMA:
        said = lines[0].get("schema") if lines else "nothing"
        raise InvalidDecisions(f"{path}:1: schema is {said!r}, valid is {SCHEMA!r}")
    try:
        kinds = dict(lines[0]["nodes"])
        return Decisions(path, lines[0]["tree"], kinds, lines[1:])
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidDecisions(f"{path}:1: should name tree and nodes ({error!r})") from error


def _of_file(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidDecisions(
            f"{path} cannot be read ({error}); give a folder that defras run --out left"
        ) from error


def _of_bag(path: Path) -> str:
    series = read_bag(path, (DECISIONS_TOPIC,)).series
    if DECISIONS_TOPIC not in series:
        raise InvalidDecisions(f"{path} has no {DECISIONS_TOPIC}: nobody published decisions in it")
    return "".join(line + "\n" for line in series[DECISIONS_TOPIC].texts)


def _object(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        found = json.loads(line)
    except ValueError as error:
        raise InvalidDecisions(f"{path}:{number}: not JSON: {error}") from error
    if not isinstance(found, dict):
        raise InvalidDecisions(f"{path}:{number}: a line should be a JSON object")
    return found


def _moment(
    line: Mapping[str, Any], nodes: dict[str, NodeWord], kinds: Mapping[str, str]
) -> Moment:
    """The tick of ``line``; brings ``nodes`` up to it."""
    for path in line.get("gone", ()):
        del nodes[path]
    for path, word in line["nodes"].items():
        nodes[path] = NodeWord(*word)
    time_s = float(line["time_s"])
    return Moment(
        tick=int(line["tick"]),
        time_s=time_s,
        nodes=dict(nodes),
        kinds=kinds,
        cause=_cause(line["cause"]),
        stopped_by=_cause(line["stopped_by"]),
        ended=_cause(line["ended"]),
        operator=str(line["operator"]),
        events=tuple(
            Event(time_s, kind, level, said) for kind, level, said in line.get("events", ())
        ),
    )


def _cause(said: list[str] | None) -> Cause | None:
    return None if said is None else Cause(*said)


def _who(cause: Cause | None) -> tuple[str, str] | None:
    return None if cause is None else (cause.path, cause.code)
