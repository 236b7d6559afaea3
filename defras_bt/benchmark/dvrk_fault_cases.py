"""Faults of the dVRK's campaign, drawn; and when each could be known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from defras_bt.dvrk.settings import Limits
from defras_bt.dvrk.stand_in.order import PERIOD_S

Killed = Literal["master", "stand_in"]

KINDS = (
    "master_killed",
    "stand_in_killed",
    "paused",
    "fault",
    "unhomed",
    "stale_stamps",
    "backward_stamps",
    "delayed",
    "lost",
    "duplicated",
    "millimetres",
    "wrong_frame",
    "frozen",
    "second_client",
)

_ARMS = ("psm1", "psm2")
_FEWEST, _MOST, _MOST_HELD = 5, 280, 120
"""Set-points that moved an arm before the fault comes, of all and of those with tissue held: a run
has some 400 to 700."""


@dataclass(frozen=True)
class DvrkFault:
    """``entry``: what is ordered from the stand-in, None where something is killed instead.

    It comes when ``after`` set-points have moved an arm: in motion. ``held``: of those that moved
    one since tissue is held, so that a grip can be lost.
    """

    kind: str
    seed: int
    after: int
    held: bool = False
    entry: Mapping[str, Any] | None = None
    killed: Killed | None = None


def drawn(kind: str, seed: int) -> DvrkFault:
    """One fault of ``kind``; equal seeds give equal ones. With odd seeds tissue is held before.

    Raises:
        KeyError: there is no such kind.
    """
    if kind not in KINDS:
        raise KeyError(kind)
    rng = np.random.default_rng([seed, *kind.encode()])
    held = seed % 2 == 1
    after = int(rng.integers(_FEWEST, _MOST_HELD if held else _MOST))
    if kind == "master_killed":
        return DvrkFault(kind, seed, after, held, killed="master")
    if kind == "stand_in_killed":
        return DvrkFault(kind, seed, after, held, killed="stand_in")
    entry: dict[str, Any] = {"fault": kind}
    if kind in ("paused", "fault", "unhomed"):
        entry["arm"] = str(rng.choice(_ARMS))
    elif kind == "second_client":
        # The arm that is being driven is known only then; both plans of this patient use psm1.
        entry |= {"arm": "psm1", "speed_m_s": float(rng.uniform(0.005, 0.03))}
    elif kind in ("stale_stamps", "backward_stamps", "delayed"):
        entry["what"] = str(rng.choice(_ARMS))
    elif kind == "lost":
        # All of them, or every second one.
        entry |= {"what": str(rng.choice(_ARMS)), "probability": float(rng.choice((0.5, 1.0)))}
    elif kind == "duplicated":
        entry["what"] = str(rng.choice((*_ARMS, "cloud")))
    return DvrkFault(kind, seed, after, held, entry)


def known_after_s(fault: DvrkFault, limits: Limits, oldest_s: float) -> float | None:
    """How long after its beginning a fault could be known; None where nothing needs to be known.

    What an arm says of itself, or does, is out with its next message; messages that stop, or whose
    stamps stand still, are missed when the last good one is older than the set-up allows. A picture
    that is wrong can be seen when it arrives (the judge knows when); one that is repeated says
    nothing before it is too old (``oldest_s``, after the last true one).
    """
    entry = fault.entry or {}
    if fault.kind == "duplicated" or (fault.kind == "lost" and entry["probability"] < 1.0):
        return None
    if fault.kind in ("stale_stamps", "delayed", "lost"):
        return limits.arm_age_s
    if fault.kind == "stand_in_killed":
        return limits.arm_age_s
    if fault.kind in ("backward_stamps", "second_client"):
        return PERIOD_S
    if fault.kind == "frozen":
        return oldest_s
    return 0.0
