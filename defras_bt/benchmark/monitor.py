"""How much of what goes wrong both discrepancy metrics notice, and how often for nothing."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from defras_bt.benchmark.mismatches import KINDS
from defras_bt.benchmark.monitor_runs import METRICS, MonitorRun
from defras_bt.monitoring.metric_track import CONFIRMING_FRAMES
from defras_sim.geometry import Floats

THRESHOLDS_M: Floats = np.concatenate([np.arange(0.25, 10, 0.25), np.arange(10, 31, 1.0)]) * 1e-3
PAPERS_THRESHOLD_M = 0.002
MATTERS_M = 0.005
"""A mismatch that moves no part of the tissue so far is none to notice."""


@dataclass(frozen=True)
class Noticed:
    """At one threshold of one metric.

    ``share`` of the mismatches that matter; ``delay_s`` is the median, from when they matter to the
    alarm. ``alarms_per_min`` are those of retractions without mismatch; of these,
    ``false_alarms_per_min`` were raised while no part of the tissue was off by 2 mm: the twin's
    mesh is another than the world's, and now and then that alone moves loose tissue by more.
    """

    metric: str
    threshold_m: float
    share: float
    delay_s: float
    alarms_per_min: float
    false_alarms_per_min: float


def noticed(runs: Sequence[MonitorRun], metric: str, threshold_m: float) -> Noticed:
    """What ``metric`` notices at ``threshold_m``."""
    share, delays = [], []
    alarms = false = 0
    minutes = 0.0
    for run in runs:
        minutes += len(run.moved_m) * run.frame_s / 60
        raised = _onsets(run.null_mu_m[metric], threshold_m)
        alarms += len(raised)
        false += sum(
            run.null_gap_m[max(0, i + 1 - CONFIRMING_FRAMES) : i + 1].max() < PAPERS_THRESHOLD_M
            for i in raised
        )
        matters = _first(run.moved_m >= MATTERS_M)
        if matters is None:
            continue
        at = _first(_confirmed(run.mu_m[metric], threshold_m)[run.starts :])
        share.append(at is not None)
        if at is not None:
            delays.append(max(0, at + run.starts - matters) * run.frame_s)
    return Noticed(
        metric,
        float(threshold_m),
        float(np.mean(share)) if share else float("nan"),
        float(np.median(delays)) if delays else float("nan"),
        alarms / minutes,
        false / minutes,
    )


def as_quiet(
    runs: Sequence[MonitorRun], metric: str, alarms_per_min: float, *, false_only: bool = False
) -> float:
    """The lowest threshold [m] at which ``metric`` raises no more alarms without a mismatch.

    ``false_only``: those are not counted during which part of the tissue really was off.

    Raises:
        ValueError: there is none up to the highest threshold.
    """
    for threshold_m in THRESHOLDS_M:
        found = noticed(runs, metric, threshold_m)
        raised = found.false_alarms_per_min if false_only else found.alarms_per_min
        if raised <= alarms_per_min:
            return float(threshold_m)
    raise ValueError(f"{metric} is never as quiet as {alarms_per_min:g} alarms per minute")


def monitor_tables(runs: Sequence[MonitorRun]) -> dict[str, list[dict[str, Any]]]:
    """Both metrics at the paper's threshold and equally quiet; by kind; over the threshold."""
    paper = noticed(runs, "median", PAPERS_THRESHOLD_M)
    quiet_m = as_quiet(runs, "local", paper.alarms_per_min)
    equal = noticed(runs, "local", quiet_m)
    false_m = as_quiet(runs, "local", paper.false_alarms_per_min, false_only=True)
    never_false = noticed(runs, "local", false_m)
    same = noticed(runs, "local", PAPERS_THRESHOLD_M)
    by_kind = []
    for kind in (kind for kind in KINDS if any(run.kind == kind for run in runs)):
        own = [run for run in runs if run.kind == kind]
        by_kind.append(
            {
                "mismatch": kind,
                "runs": len(own),
                "matter (5 mm)": sum(bool(run.moved_m.max() >= MATTERS_M) for run in own),
                "median at 2 mm": _percent(noticed(own, "median", PAPERS_THRESHOLD_M).share),
                f"local at {1e3 * quiet_m:g} mm": _percent(noticed(own, "local", quiet_m).share),
                "local at 2 mm": _percent(noticed(own, "local", PAPERS_THRESHOLD_M).share),
            }
        )
    curve = [_row(noticed(runs, m.name, t)) for m in METRICS for t in THRESHOLDS_M]
    return {
        "Both metrics": [_row(found) for found in (paper, equal, never_false, same)],
        "Noticed, by mismatch": by_kind,
        "Over the threshold": curve,
    }


def monitor_figure(runs: Sequence[MonitorRun]) -> str:
    """Share noticed and median delay over alarms without mismatch, as SVG."""
    colours = {"local": "#186a3b", "median": "#1f618d"}
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12.5, 3.8))
        for metric in METRICS:
            curve = [noticed(runs, metric.name, t) for t in THRESHOLDS_M]
            colour, name = colours[metric.name], metric.name
            share = [100 * c.share for c in curve]
            left.plot([c.alarms_per_min for c in curve], share, ".-", color=colour, label=name)
            middle.plot(1e3 * THRESHOLDS_M, share, ".-", color=colour, label=name)
            delay = [c.delay_s for c in curve]
            right.plot(1e3 * THRESHOLDS_M, delay, ".-", color=colour, label=name)
        left.set(xlabel="alarms per minute without mismatch", ylabel="noticed [%]", ylim=(0, 102))
        left.set_xscale("symlog", linthresh=0.1)
        middle.set(xlabel="threshold [mm]", ylabel="noticed [%]", ylim=(0, 102))
        right.set(xlabel="threshold [mm]", ylabel="median delay [s]")
        left.legend(frameon=False)
        figure.tight_layout()
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg")
        plt.close(figure)
    svg = buffer.getvalue()
    return svg[svg.index("<svg") :]


def _row(found: Noticed) -> dict[str, Any]:
    return {
        "metric": found.metric,
        "threshold mm": round(1e3 * found.threshold_m, 2),
        "noticed": _percent(found.share),
        "median delay s": round(found.delay_s, 2),
        "alarms per min without mismatch": round(found.alarms_per_min, 3),
        "of these nothing off by 2 mm": round(found.false_alarms_per_min, 3),
    }


def _percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{share:.0%}"


def _confirmed(mu_m: Floats, threshold_m: float) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Frames (n,) at which so many in a row were over the threshold; NaN is not."""
    over = np.nan_to_num(mu_m) > threshold_m
    count = np.convolve(over, np.ones(CONFIRMING_FRAMES, int))[: len(over)]
    return np.asarray(count == CONFIRMING_FRAMES)


def _onsets(mu_m: Floats, threshold_m: float) -> list[int]:
    alarm = _confirmed(mu_m, threshold_m)
    return [int(i) for i in np.flatnonzero(alarm & ~np.concatenate([[False], alarm[:-1]]))]


def _first(marks: np.ndarray[Any, np.dtype[np.bool_]]) -> int | None:
    found = np.flatnonzero(marks)
    return int(found[0]) if len(found) else None
