"""What a report needs of a run: numbers of every tick, pictures of the first and the last."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from defras_bt.planning.plan import Plan
from defras_bt.recording.record import Event, RunInfo, TickRecord
from defras_sim.geometry import Floats

STATUSES = ("RUNNING", "SUCCESS", "FAILURE")


@dataclass(frozen=True)
class Span:
    """Something that lasted from ``begin_s`` to ``end_s`` of world time."""

    begin_s: float
    end_s: float
    name: str


@dataclass
class RunLog:
    """Grows tick by tick; :meth:`add` keeps no surface but the first and the latest."""

    info: RunInfo
    events: list[Event] = field(default_factory=list)
    plans: list[tuple[float, Plan]] = field(default_factory=list)
    beliefs: list[tuple[float, NDArray[np.bool_]]] = field(default_factory=list)
    node_ticks: dict[str, Counter[str]] = field(default_factory=dict)
    first: TickRecord | None = None
    last: TickRecord | None = None
    with_pictures: list[TickRecord] = field(default_factory=list)
    _rows: list[tuple[float, ...]] = field(default_factory=list)
    _metrics: tuple[str, ...] = ()
    _spans: list[Span] = field(default_factory=list)
    _states: list[Span] = field(default_factory=list)

    def add(self, record: TickRecord) -> None:
        self.first = self.first or record
        if record.observation.endoscope_image is not None:
            self.with_pictures = [*self.with_pictures[:1], record]
        self.last = record
        self.events += record.events
        if record.plan is not None and (not self.plans or self.plans[-1][1] is not record.plan):
            self.plans.append((record.time_s, record.plan))
        if not self.beliefs or not np.array_equal(self.beliefs[-1][1], record.believed):
            self.beliefs.append((record.time_s, record.believed.copy()))
        for path, status in record.node_status.items():
            if status:
                self.node_ticks.setdefault(path, Counter())[status] += 1
        self._add_numbers(record)
        _extend(self._spans, record.time_s, record.action.name if record.action else "")
        state = self.info.warning_state(record.reading)
        _extend(self._states, record.time_s, "" if state is None else str(state))

    @property
    def metric(self) -> str | None:
        return self.info.metric

    @property
    def metrics(self) -> tuple[str, ...]:
        return self._metrics

    @property
    def actions(self) -> tuple[Span, ...]:
        """What was carried out when; gaps are left out."""
        return tuple(span for span in self._spans if span.name)

    @property
    def warning_states(self) -> tuple[Span, ...]:
        return tuple(span for span in self._states if span.name)

    def column(self, name: str) -> Floats:
        """One number per tick, NaN where it is unknown.

        ``time_s``, ``force_n``, ``true_force_n``, ``rate``, ``visibility``, ``mu_<metric>_m``.
        """
        measured = [f"mu_{metric}_m" for metric in self._metrics]
        names = ["time_s", "force_n", "true_force_n", "rate", "visibility", *measured]
        if name not in names:
            raise KeyError(f"no column {name}; there are {', '.join(names)}")
        at = names.index(name)
        return np.array([row[at] if at < len(row) else np.nan for row in self._rows])

    def _add_numbers(self, record: TickRecord) -> None:
        mu_m = {} if record.reading is None else record.reading.mu_m
        self._metrics += tuple(metric for metric in mu_m if metric not in self._metrics)
        self._rows.append(
            (
                record.time_s,
                record.force_n,
                _or_nan(record.true_force_n),
                record.rate,
                _or_nan(record.observation.roi_visibility),
                *(mu_m.get(metric, np.nan) for metric in self._metrics),
            )
        )


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _extend(spans: list[Span], time_s: float, name: str) -> None:
    """Lengthen the last span, and open a new one where the name changes."""
    if spans:
        spans[-1] = Span(spans[-1].begin_s, time_s, spans[-1].name)
    if not spans or spans[-1].name != name:
        spans.append(Span(time_s, time_s, name))
