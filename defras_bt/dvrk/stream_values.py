"""A stream's numbers as ``run.json`` holds them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from defras_bt.dvrk.streaming.servo_loop import StreamReport


def stream_values(report: StreamReport) -> Mapping[str, Any]:
    """The content of the key ``stream``."""
    return {
        "period": report.period.values(),
        "latency": {name: _pair(pair) for name, pair in sorted(report.latency_s.items())},
        "taken_up": None if report.took_up_s is None else _pair(report.took_up_s),
        "realtime": report.realtime,
    }


def _pair(pair: tuple[float, float]) -> Mapping[str, float]:
    median_s, p99_s = pair
    return {"median_s": median_s, "p99_s": p99_s}
