"""What really happened: the stand-in's own record, for judges of those who command it.

One JSON object per line. ``event`` is "fault" (one begins or ends), "goal" (a command came in,
``way_m``: how far it is from the last one of its kind, ``refused`` where it was, ``by`` where a
second client of the stand-in's own sent it), "arm" (an arm's true state, every 20 ms), "clock" (ROS
time of world time 0). The cameras have a file of their own, with "picture": one left, ``faults``
being there.
"""

from __future__ import annotations

import json
from pathlib import Path
from threading import Lock
from typing import Any


class Witness:
    """Writes the record; with no file it writes nothing. May be told from any thread."""

    def __init__(self, file: Path | None) -> None:
        """
        Raises:
            OSError: the file cannot be written.
        """
        self._lock = Lock()
        # Line by line, so that a killed stand-in leaves all it saw.
        self._file = None if file is None else file.open("w", encoding="utf-8", buffering=1)

    def tell(self, event: str, time_s: float, **facts: Any) -> None:
        """``time_s``: world time."""
        if self._file is None:
            return
        line = json.dumps({"event": event, "time_s": round(time_s, 6), **facts})
        with self._lock:
            self._file.write(line + "\n")

    def close(self) -> None:
        if self._file is not None:
            self._file.close()


def cameras_witness(file: Path | None) -> Path | None:
    """The cameras' file beside that of the arms.

    >>> cameras_witness(Path("run/witness.jsonl"))
    PosixPath('run/witness.cameras.jsonl')
    """
    return None if file is None else file.with_name(f"{file.stem}.cameras{file.suffix}")
