"""What the executive and the process that streams set-points say to each other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from defras_bt.dvrk.settings import Setup

Request = Literal["snapshot", "clock", "report", "close"]
"""Each is answered once. A tick is not answered."""


@dataclass(frozen=True)
class Begin:
    """Connect and drive; ``log_file`` takes every set-point."""

    setup: Setup
    log_file: Path | None


@dataclass(frozen=True)
class Begun:
    """The answer: ``why_not`` in words where it cannot; and what was found."""

    why_not: str = ""
    simulated_clock: bool = False
    realtime: bool = False
