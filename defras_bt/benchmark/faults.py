"""The fault campaign: every kind of fault, many times, each run judged from outside."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from joblib import Parallel, delayed

from defras_bt.benchmark.fault_cases import MORE, drawn_fault, patient
from defras_bt.benchmark.fault_errors import undeclared
from defras_bt.benchmark.fault_judge import (
    NUMBERS,
    RECORDING,
    TIMELINE,
    Verdict,
    Witness,
    lost_recordings,
    verdict,
)
from defras_bt.executive.deadline import interrupting
from defras_bt.executive.operation import Operation, operate
from defras_bt.faults.faults import KINDS, FaultInjection, Faults
from defras_bt.faults.system import DiskFull, Killed
from defras_bt.planning.preparation import Preparation, prepare
from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.record import Recorder
from defras_bt.recording.summary import SummaryRecorder, read_run_json
from defras_bt.recording.timeline import TimelineRecorder
from defras_sim.resources import resource

MAX_TIME_S = 25.0
# A tick that learns takes seconds; only where a node hangs for ever is the limit meant to strike.
LONGEST_TICK_S = 120.0
LONGEST_HANG_S = 5.0
# So often the patient is held in more places than believed: learning takes its time.
MORE_EVERY = 5
_KILLED_WITHIN_S = 300.0
_TOO_LONG = 124
# How a run ends that the executive ended itself.
_DECIDED = ("goal", "human", "not_reached")
_BROKEN_RECORDERS = {"timeline": (TIMELINE,), "recording": (RECORDING,)}


@dataclass(frozen=True)
class FaultRun:
    """One run of the campaign: which fault, when, and the judge's verdict."""

    kind: str
    seed: int
    start_s: float
    verdict: Verdict


def campaign(
    kinds: Sequence[str], seeds: Sequence[int], jobs: int = 2, tree: str = "defras"
) -> Iterator[FaultRun]:
    """Run every kind with every seed; runs come as they end.

    The plan is made once. In every fifth run the patient is held in more places than believed.
    """
    prepared = prepare(patient())
    work = (delayed(fault_run)(kind, seed, prepared, tree) for kind in kinds for seed in seeds)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


def fault_run(kind: str, seed: int, prepared: Preparation, tree: str = "defras") -> FaultRun:
    """One run with one fault, recorded and judged."""
    faults = drawn_fault(kind, seed)
    with TemporaryDirectory(prefix="defras_fault_") as folder:
        judge = _judged_killed if kind == "killed" else _judged
        found = judge(_operation(seed, prepared, tree), faults, Path(folder))
    return FaultRun(kind, seed, faults.faults[0].start_s, found)


def _operation(seed: int, prepared: Preparation, tree: str) -> Operation:
    return Operation(
        scene=patient(),
        actual=patient(MORE) if seed % MORE_EVERY == 1 else patient(),
        scene_file="fault campaign",
        actual_file=None,
        world="model",
        tree_file=resource(f"trees/{tree}.yaml"),
        seed=seed,
        force_threshold_n=prepared.force_threshold_n,
        preoperative=prepared.plan,
        max_time_s=MAX_TIME_S,
    )


def _judged(operation: Operation, faults: Faults, out: Path) -> Verdict:
    witness = Witness()
    injection = FaultInjection(faults, operation.scene, operation.seed)
    broke = ""
    try:
        _operate(operation, injection, out, witness)
    except Exception as error:  # noqa: BLE001  (that is what the campaign looks for)
        broke = "; ".join(undeclared(error, faults))
    end_s = witness.moments[-1].time_s if witness.moments else 0.0
    lost = lost_recordings(out, _until_s(faults, end_s))
    return verdict(witness, injection.trips, lost, broke)


def _operate(operation: Operation, injection: FaultInjection, out: Path, witness: Witness) -> None:
    recorders: list[Recorder] = [
        witness,
        TimelineRecorder(out / TIMELINE),
        BagRecorder(out / RECORDING),
        SummaryRecorder(out / NUMBERS),
    ]
    limit_s = LONGEST_HANG_S if injection.hangs else LONGEST_TICK_S
    operate(operation, recorders, faults=injection, deadline=interrupting(limit_s))


def _until_s(faults: Faults, end_s: float) -> dict[str, float]:
    """How far each file has to reach: to the end, or to where its disk was full."""
    needed = dict.fromkeys((TIMELINE, RECORDING, NUMBERS), end_s)
    for fault in faults.faults:
        if isinstance(fault, DiskFull):
            for name in _BROKEN_RECORDERS.get(fault.recorder, (TIMELINE, RECORDING)):
                needed[name] = min(end_s, fault.start_s)
    return needed


def _judged_killed(operation: Operation, faults: Faults, out: Path) -> Verdict:
    """Run in a process of its own, which kills itself; what it left must be readable.

    A run that reached its outcome before it would have been killed is judged by its end.
    """
    exit_code = _run_apart(operation, faults, out)
    killed_s = faults.faults[0].start_s
    if exit_code == 0:
        numbers = read_run_json(out / NUMBERS)
        end_s, outcome = numbers.duration_s, numbers.outcome
        if end_s < killed_s:
            lost = lost_recordings(out, dict.fromkeys((TIMELINE, RECORDING, NUMBERS), end_s))
            why = "the run ended before it would have been killed"
            return Verdict(outcome, why, 0, False, 0, 0, 0, tuple(lost), "")
    by_signal = exit_code == -signal.SIGKILL
    broke = "" if by_signal else f"it ended with exit code {exit_code}, not killed"
    lost = lost_recordings(out, {TIMELINE: killed_s, RECORDING: killed_s})
    return Verdict("killed", "the process was killed", 0, True, 0, 0, 0, tuple(lost), broke)


def _run_apart(operation: Operation, faults: Faults, out: Path) -> int:
    """Exit code of a Python process that only does this; negative: the signal that ended it.

    Not one of multiprocessing's: those cannot be started by every kind of worker.
    """
    order = out / "order.pickle"
    order.write_bytes(pickle.dumps((operation, faults, out)))
    command = [sys.executable, "-m", __name__, str(order)]
    try:
        return subprocess.run(command, timeout=_KILLED_WITHIN_S, check=False).returncode
    except subprocess.TimeoutExpired:
        return _TOO_LONG
    finally:
        order.unlink()


def _until_killed(order: Path) -> None:
    operation, faults, out = pickle.loads(order.read_bytes())
    injection = FaultInjection(faults, operation.scene, operation.seed)
    _operate(operation, injection, out, Witness())


def by_kind(runs: Sequence[FaultRun]) -> list[dict[str, Any]]:
    """One line per kind of fault, and one for all."""
    kinds = list(dict.fromkeys(run.kind for run in sorted(runs, key=lambda run: run.kind)))
    lines = [_line(kind, [run for run in runs if run.kind == kind]) for kind in kinds]
    return [*lines, _line("all", runs)]


def _line(name: str, runs: Sequence[FaultRun]) -> dict[str, Any]:
    verdicts = [run.verdict for run in runs]

    def ended(outcome: str) -> int:
        return sum(v.outcome == outcome for v in verdicts)

    return {
        "fault": name,
        "runs": len(runs),
        "had to stop": sum(v.tripped for v in verdicts),
        "goal": ended("goal"),
        "human": ended("human"),
        "gave up, holding": ended("not_reached"),
        "stopped by error": ended("error"),
        "killed": ended("killed"),
        "replanned": sum(v.replans > 0 for v in verdicts),
        "motion within one tick": sum(v.in_time for v in verdicts),
        "motion later than one tick": sum(v.late for v in verdicts),
        "wrong motion": sum(v.wrong for v in verdicts),
        "lost recordings": sum(len(v.lost) for v in verdicts),
        "uncaught exceptions": sum(bool(v.broke) for v in verdicts),
        "without reason": sum(not v.reason for v in verdicts),
    }


def by_run(runs: Sequence[FaultRun]) -> list[dict[str, Any]]:
    """One line per run."""
    return [
        {
            "fault": run.kind,
            "seed": run.seed,
            "start s": run.start_s,
            "outcome": run.verdict.outcome,
            "reason": run.verdict.reason,
            "replans": run.verdict.replans,
            "motion within one tick": run.verdict.in_time,
            "motion later than one tick": run.verdict.late,
            "wrong motion": run.verdict.wrong,
            "lost": "; ".join(run.verdict.lost),
            "uncaught": run.verdict.broke,
        }
        for run in sorted(runs, key=lambda run: (run.kind, run.seed))
    ]


def passed(runs: Sequence[FaultRun]) -> bool:
    """Whether nothing went wrong that should not, and every run ended as its fault allows."""
    return not any(
        v.late
        or v.wrong
        or v.lost
        or v.broke
        or not v.reason
        or v.outcome not in _endings(kind, v.tripped)
        for kind, v in ((run.kind, run.verdict) for run in runs)
    )


def _endings(kind: str, tripped: bool) -> tuple[str, ...]:
    """The outcomes that a fault of ``kind`` may lead to, if it came (``tripped``) to it."""
    if kind == Killed.kind:
        return ("killed",) if tripped else _DECIDED
    return (*_DECIDED, "error") if KINDS[kind].ends_runs_with else _DECIDED


if __name__ == "__main__":
    _until_killed(Path(sys.argv[1]))
