"""What pages about runs and about diagnoses are made of."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tile:
    """One key number: ``value`` stands large, ``note`` under it; ``tone`` is good, bad or plain."""

    name: str
    value: str
    note: str = ""
    tone: str = "plain"


@dataclass(frozen=True)
class Panel:
    """A picture with what it shows."""

    caption: str
    address: str
