"""What the executive and the process that streams set-points say to each other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from defras_bt.dvrk.settings import Setup

Question = Literal["snapshot", "clock", "report", "close"]


@dataclass(frozen=True)
class Request:
    """Answered once, with the same ``number``: an answer that comes too late is told from the one
    that is waited for. A tick is not answered."""

    number: int
    question: Question


@dataclass(frozen=True)
class Answer:
    """What was asked for by the request of this ``number``."""

    number: int
    content: Any


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
