"""The dVRK's fault campaign: every fault many times over a real ROS master, one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from defras_bt.benchmark.dvrk_fault_cases import KINDS, drawn
from defras_bt.benchmark.dvrk_fault_judge import LATE_S, DvrkVerdict
from defras_bt.benchmark.dvrk_fault_trial import trial
from defras_bt.benchmark.dvrk_patient import slow_patient
from defras_bt.benchmark.own_process import ProcessFailed, in_own_process
from defras_bt.benchmark.retraction import Row
from defras_bt.planning.preparation import prepare

_TRIAL_S = 420.0


@dataclass(frozen=True)
class DvrkRun:
    """One run of the campaign; ``verdict`` None where the trial itself broke, as ``broke`` says."""

    kind: str
    seed: int
    verdict: DvrkVerdict | None
    broke: str = ""

    @property
    def passed(self) -> bool:
        return self.verdict is not None and self.verdict.passed


def key_of(kind: str, seed: int) -> str:
    """How a run is found among rows on disk."""
    return Row(kind, "seed", str(seed), {}).key


def row_of(run: DvrkRun) -> Row:
    """A run as a row on disk."""
    verdict = None if run.verdict is None else asdict(run.verdict)
    return Row(run.kind, "seed", str(run.seed), {"verdict": verdict, "broke": run.broke})


def run_of(row: Row) -> DvrkRun:
    """The run that a row on disk is of."""
    said = row.values["verdict"]
    verdict = None if said is None else DvrkVerdict(**{**said, "lost": tuple(said["lost"])})
    return DvrkRun(row.case, int(row.run), verdict, row.values["broke"])


def campaign(
    kinds: Sequence[str], seeds: Sequence[int], done: frozenset[str] = frozenset()
) -> Iterator[DvrkRun]:
    """Run every kind with every seed but those in ``done``: every kind once, then once more, so
    that a campaign that is cut short has seen all kinds.

    One after the other and in real time: side by side they would disturb each other.
    """
    prepared = prepare(slow_patient())
    for seed in seeds:
        for kind in kinds:
            if key_of(kind, seed) in done:
                continue
            with TemporaryDirectory(prefix="defras_dvrk_") as folder:
                fault = drawn(kind, seed)
                try:
                    verdict = in_own_process(
                        trial, fault, prepared, Path(folder), within_s=_TRIAL_S
                    )
                    yield DvrkRun(kind, seed, verdict)
                except ProcessFailed as error:
                    yield DvrkRun(kind, seed, None, str(error).strip().splitlines()[-1])


def by_kind(runs: Sequence[DvrkRun]) -> list[dict[str, Any]]:
    """One line per kind of fault, and one for all."""
    kinds = [kind for kind in KINDS if any(run.kind == kind for run in runs)]
    return [
        *(_line(kind, [run for run in runs if run.kind == kind]) for kind in kinds),
        _line("all", runs),
    ]


def _line(name: str, runs: Sequence[DvrkRun]) -> dict[str, Any]:
    verdicts = [run.verdict for run in runs if run.verdict is not None]
    late_ms = [v.late_ms for v in verdicts if v.known_s is not None and np.isfinite(v.known_s)]

    def ended(outcome: str) -> int:
        return sum(v.outcome == outcome for v in verdicts)

    return {
        "fault": name,
        "runs": len(runs),
        "passed": sum(run.passed for run in runs),
        "had to stop": len(late_ms),
        "motion after it could be known, median ms": _rounded(np.median(late_ms or [np.nan])),
        "worst ms": _rounded(max(late_ms, default=np.nan)),
        f"later than {1e3 * LATE_S:g} ms": sum(late > 1e3 * LATE_S for late in late_ms),
        "tissue held": sum(v.held for v in verdicts),
        "grip lost": sum(v.grip_lost for v in verdicts),
        "goal": ended("goal"),
        "human": ended("human"),
        "gave up, holding": ended("not_reached"),
        "without reason": sum(not v.reason for v in verdicts),
        "lost recordings": sum(len(v.lost) for v in verdicts),
        "no restart": sum(bool(v.restarts) for v in verdicts),
        "broke": sum(bool(v.broke) for v in verdicts) + sum(run.verdict is None for run in runs),
    }


def by_run(runs: Sequence[DvrkRun]) -> list[dict[str, Any]]:
    """One line per run."""
    lines = []
    for run in runs:
        verdict = run.verdict
        line: dict[str, Any] = {"fault": run.kind, "seed": run.seed, "passed": run.passed}
        if verdict is None:
            lines.append({**line, "broke": run.broke})
            continue
        known = verdict.known_s is not None and np.isfinite(verdict.known_s)
        lines.append(
            {
                **line,
                "begun s": _rounded(verdict.begun_s),
                "known s": _rounded(verdict.known_s) if known else None,
                "late ms": _rounded(verdict.late_ms) if known else None,
                "held": verdict.held,
                "grip lost": verdict.grip_lost,
                "outcome": verdict.outcome,
                "reason": verdict.reason,
                "lost": "; ".join(verdict.lost),
                "restart": verdict.restarts,
                "broke": verdict.broke,
            }
        )
    return lines


def _rounded(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else round(float(value), 1)
