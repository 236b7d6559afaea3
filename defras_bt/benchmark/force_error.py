"""How far the twin's force is from the true one, before and after each attachment update."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from defras_bt.recording.record import RunInfo, RunSummary, TickRecord


@dataclass
class ForceError:
    """A recorder. The executive never sees the true force; only simulated worlds tell it.

    ``before_n`` and ``after_n``: |estimate - truth| at the ticks at which tissue was held, before
    the first adopted update of a run and after the last one. Without an update all are "before".
    """

    before_n: list[float] = field(default_factory=list)
    after_n: list[float] = field(default_factory=list)
    adopted: int = 0
    summary: dict[str, object] = field(default_factory=dict)

    def start(self, info: RunInfo) -> None: ...

    def tick(self, record: TickRecord) -> None:
        for event in record.events:
            if event.kind == "learning" and event.data.get("adopted"):
                self.adopted += 1
                self.after_n.clear()  # what counts is the belief of the last update
        true_n = record.true_force_n
        if true_n is None or not (math.isfinite(record.force_n) and math.isfinite(true_n)):
            return
        if max(record.force_n, true_n) > 0.0:
            errors = self.after_n if self.adopted else self.before_n
            errors.append(abs(record.force_n - true_n))

    def finish(self, summary: RunSummary) -> None:
        self.summary = dict(summary.values)

    def values(self) -> dict[str, float | None]:
        """Medians [N] for the table; None where there was nothing to compare."""
        return {
            "force_error_before_n": _median(self.before_n),
            "force_error_after_n": _median(self.after_n),
        }


def _median(errors_n: list[float]) -> float | None:
    return float(np.median(errors_n)) if errors_n else None
