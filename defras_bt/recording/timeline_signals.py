"""The curves of a timeline: forces, discrepancies, rate, visibility, and their limits."""

from __future__ import annotations

import math

import rerun as rr

from defras_bt.recording import palette
from defras_bt.recording.record import RunInfo, TickRecord
from defras_bt.recording.timeline_changes import packed

_LIMITS_EVERY = 20
_SERIES: dict[str, tuple[tuple[str, ...], tuple[palette.Rgb, ...], float]] = {
    "force_n/estimated": (("estimated",), (palette.ESTIMATED,), 2.0),
    "force_n/true": (("true",), (palette.TRUE,), 2.0),
    "force_n/epsilon": (("epsilon",), (palette.WARNING_STATES[3],), 1.0),
    "mu_mm/local": (("local",), (palette.ESTIMATED,), 2.0),
    "mu_mm/median": (("median",), (palette.MEDIAN,), 2.0),
    "mu_mm/thresholds": (("delta1", "delta2", "delta3"), palette.WARNING_STATES[1:], 1.0),
    "rate": (("rate",), (palette.ARMS["psm1"],), 2.0),
    "visibility": (("visibility",), (palette.ROI,), 2.0),
}


def log_series(stream: rr.RecordingStream) -> None:
    for path, (names, colours, width) in _SERIES.items():
        lines = rr.SeriesLines(names=names, colors=packed(colours), widths=[width] * len(names))
        stream.log(f"signals/{path}", lines, static=True)


def log_signals(stream: rr.RecordingStream, record: TickRecord, info: RunInfo) -> None:
    measured = {} if record.reading is None else record.reading.mu_m
    for path, value in {
        "force_n/estimated": record.force_n,
        "force_n/true": record.true_force_n,
        **{f"mu_mm/{metric}": 1000 * mu_m for metric, mu_m in measured.items()},
        "rate": record.rate,
        "visibility": record.observation.roi_visibility,
    }.items():
        # Not a number makes a gap; written down, it would compare unequal to itself.
        if value is not None and math.isfinite(value):
            stream.log(f"signals/{path}", rr.Scalars(value))
    if record.tick % _LIMITS_EVERY == 0:
        log_limits(stream, info)


def log_limits(stream: rr.RecordingStream, info: RunInfo) -> None:
    """Limits are constant: enough points to draw a line, and one at the end."""
    deltas_mm = [1000 * delta_m for delta_m in info.scene.thresholds.delta_m]
    stream.log("signals/mu_mm/thresholds", rr.Scalars(deltas_mm))
    stream.log("signals/force_n/epsilon", rr.Scalars(info.force_threshold_n))
