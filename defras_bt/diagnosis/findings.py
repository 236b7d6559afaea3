"""What a diagnosis has found so far; grows, so that an interrupted one can be reported."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from defras_bt.diagnosis.confounding import Confounding
from defras_bt.diagnosis.fitted import Fit
from defras_bt.diagnosis.outside import LeftOver
from defras_bt.diagnosis.search import Search
from defras_bt.diagnosis.verdict import Estimate, Excluded


def _nothing_known() -> Confounding:
    return Confounding((), np.zeros((0, 0)), np.zeros(0), np.zeros(0))


@dataclass
class Findings:
    """``base``: the model with base parameters only. ``rivals``: by accepted cause, the fits of
    those that cannot be told from it; ``proposed``: the motion that would. ``further``: gain by
    name of further data; ``gains``: share of the first excess that is back without a cause;
    ``remarks``: sentences for the reader."""

    search: Search
    base: Fit
    confounding: Confounding = field(default_factory=_nothing_known)
    rivals: dict[str, dict[str, Fit]] = field(default_factory=dict)
    proposed: str | None = None
    estimates: dict[str, dict[str, Estimate]] = field(default_factory=dict)
    gains: dict[str, float] = field(default_factory=dict)
    excluded: dict[str, Excluded] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    left: LeftOver = field(default_factory=lambda: LeftOver(()))
    further: dict[str, float | None] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    complete: bool = False

    def ambiguous(self) -> dict[str, dict[str, Fit]]:
        """By accepted cause, those of its rivals that are other effects: another place of the same
        one is not another cause."""
        return {
            key: {r: fit for r, fit in self.rivals.get(key, {}).items() if not _alike(r, key)}
            for key in self.search.accepted()
        }


def _alike(one: str, other: str) -> bool:
    return one.split("@")[0] == other.split("@")[0]
