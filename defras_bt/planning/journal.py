"""A file that remembers finished rehearsals, so that a killed search goes on where it was.

One JSON object a line, written as soon as a grasp point is done: ``key`` (scene, step and format),
``point`` [column, row], ``executions``. A line that a kill cut short is left out when reading.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from defras_bt.planning.execution import Execution
from defras_bt.planning.plan import GridPoint
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.scene import Scene

_EXECUTIONS = TypeAdapter(tuple[Execution, ...])


def search_key(scene: Scene, step_m: float) -> str:
    """What must be equal for a finished rehearsal to count: the scene's content and the step."""
    return f"1:{scene_hash(scene)}:{step_m:g}"


class Journal:
    """Finished grasp points, by search. Safe to read after the writer was killed."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._known: dict[tuple[str, GridPoint], tuple[Execution, ...]] = {}
        if file.exists():
            content = file.read_text(encoding="utf-8")
            self._read(content)
            if content and not content.endswith("\n"):  # a kill cut the last line short
                file.write_text(content[: content.rfind("\n") + 1], encoding="utf-8")

    def known(self, key: str, point: GridPoint) -> tuple[Execution, ...] | None:
        """What came of ``point``; None if it was not finished."""
        return self._known.get((key, point))

    def add(self, key: str, point: GridPoint, executions: Sequence[Execution]) -> None:
        """Remember a finished grasp point, on disk before this returns."""
        self._known[key, point] = tuple(executions)
        line = {"key": key, "point": point, "executions": [asdict(e) for e in executions]}
        with self.file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")

    def _read(self, content: str) -> None:
        for number, line in enumerate(content.splitlines(keepends=True), start=1):
            if not line.endswith("\n"):
                return
            try:
                entry = json.loads(line)
                point = (int(entry["point"][0]), int(entry["point"][1]))
                self._known[entry["key"], point] = _EXECUTIONS.validate_python(entry["executions"])
            except (json.JSONDecodeError, KeyError, TypeError, ValidationError) as error:
                raise InvalidJournal(
                    f"{self.file}:{number}: not a line of a rehearsal journal ({error}); remove "
                    "the file to rehearse everything again"
                ) from error


class InvalidJournal(ValueError):
    """The file is something else."""
