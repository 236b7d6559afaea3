"""Verdict: what a diagnosis says, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

VerdictName = Literal["named", "set", "outside", "nothing"]


@dataclass(frozen=True)
class Estimate:
    """A parameter's value with its 90 % interval."""

    value: float
    unit: str
    interval90: tuple[float, float]


@dataclass(frozen=True)
class Gain:
    """Share of the excess error (above the sensor's noise floor) that was removed; None where the
    data cannot say. Negative: it got worse."""

    in_range: float | None = None
    beyond_range: float | None = None
    new_grasp: float | None = None


@dataclass(frozen=True)
class Cause:
    """A named effect; ``gain`` is what it alone adds, held out. ``cannot_tell`` are candidates
    that explain the same as well."""

    effect: str
    site: str
    parameters: Mapping[str, Estimate]
    gain: float
    cannot_tell: tuple[str, ...] = ()


@dataclass(frozen=True)
class Excluded:
    """An effect of more than ``strength`` would have shown, with 95 % confidence."""

    strength: float
    unit: str
    parameter: str


@dataclass(frozen=True)
class Verdict:
    """What a diagnosis says. ``ambiguous`` (``set`` in files) are effects that cannot be told
    apart with this data; ``warnings`` are sentences a reader should know (extrapolation, ...)."""

    verdict: VerdictName
    causes: tuple[Cause, ...]
    ambiguous: tuple[str, ...]
    excluded: Mapping[str, Excluded]
    gain: Gain
    unexplained_share: float | None
    proposed_motion: str | None = None
    warnings: tuple[str, ...] = ()
    data_quality: Mapping[str, object] = field(default_factory=dict)
