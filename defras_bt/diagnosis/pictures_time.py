"""The residual over time: one row per sensor, one column per recording."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from defras_bt.diagnosis.diagnosis import Diagnosis
from defras_bt.diagnosis.problem import Integers, Samples
from defras_bt.diagnosis.report_words import unit_shown
from defras_bt.recording import palette
from defras_bt.recording.figures import FIGURE_STYLE, svg_text
from defras_bt.recording.palette import css
from defras_sim.geometry import Floats

MOST_TRAJECTORIES = 4
MOST_ROWS = 6
_MOST_LINES = 6
"""A sensor of more channels than this is shown by their root mean square."""
_BEFORE, _AFTER = "#c24a3a", css(palette.ESTIMATED)
_PHASES = ("#eef1f4", "#f8f9fa")


@dataclass(frozen=True)
class Row:
    """Channels (indices) shown together: one signed curve, or the root mean square of many."""

    name: str
    unit: str
    channels: tuple[int, ...]
    noise_sd: float

    @property
    def signed(self) -> bool:
        return len(self.channels) == 1


def rows(samples: Samples) -> tuple[Row, ...]:
    """One row per sensor, or per channel where a sensor has few."""
    sensors: dict[str, list[int]] = {}
    for index, channel in enumerate(samples.channels):
        sensors.setdefault(f"{channel.sensor} [{channel.unit}]", []).append(index)
    found: list[Row] = []
    for members in sensors.values():
        first = samples.channels[members[0]]
        if len(members) > _MOST_LINES:
            noise = np.sqrt(np.mean([samples.channels[i].noise_sd ** 2 for i in members]))
            found.append(Row(first.sensor, first.unit, tuple(members), float(noise)))
        else:
            for i in members:
                channel = samples.channels[i]
                found.append(Row(channel.name, channel.unit, (i,), channel.noise_sd))
    return tuple(sorted(found, key=lambda row: row.channels[0]))


def striking_rows(diagnosis: Diagnosis) -> tuple[Row, ...]:
    """Those of :func:`rows` in which the plain model is most off beside the noise, in order."""
    samples, residual = diagnosis.samples, diagnosis.held_out_before

    def off(row: Row) -> float:
        seen = residual[np.isin(samples.channel, row.channels)]
        seen = seen[np.isfinite(seen)]
        return float(np.sqrt(np.mean(seen**2))) / max(row.noise_sd, 1e-12) if len(seen) else 0.0

    found = rows(samples)
    best = sorted(found, key=off, reverse=True)[:MOST_ROWS]
    return tuple(row for row in found if row in best)


def curve(samples: Samples, row: Row, trajectory: int, residual: Floats) -> tuple[Floats, Floats]:
    """Times (k,) and residuals (k,) of ``row`` in SI units; NaN where nothing was compared."""
    chosen = (samples.trajectory == trajectory) & np.isin(samples.channel, row.channels)
    times, at = np.unique(samples.time_s[chosen], return_inverse=True)
    values, seen = residual[chosen], np.isfinite(residual[chosen])
    count = np.bincount(at[seen], minlength=len(times)).astype(float)
    count[count == 0] = np.nan
    if row.signed:
        return times, np.bincount(at[seen], values[seen], len(times)) / count
    return times, np.sqrt(np.bincount(at[seen], values[seen] ** 2, len(times)) / count)


def over_time_svg(diagnosis: Diagnosis, *, extended: bool) -> str:
    """Plain model and, with ``extended``, that one; the noise of each sensor as a band."""
    samples = diagnosis.samples
    shown = [
        (index, name)
        for index, name in enumerate(samples.trajectories)
        if np.any(samples.trajectory == index)
    ][:MOST_TRAJECTORIES]
    lines = striking_rows(diagnosis)
    durations = [_duration_s(samples, index) for index, _ in shown]
    with matplotlib.rc_context(FIGURE_STYLE):
        height = 1.25 * len(lines) + 1.1
        figure = Figure(figsize=(10.2, height))
        axes = figure.subplots(
            len(lines),
            len(shown),
            squeeze=False,
            sharex="col",
            sharey="row",
            width_ratios=[max(d, 0.15 * max(durations)) for d in durations],
            gridspec_kw={
                "hspace": 0.16,
                "wspace": 0.04,
                "bottom": 0.75 / height,
                "top": 1 - 0.35 / height,
            },
        )
        for line, row in zip(axes, lines, strict=True):
            factor, unit = unit_shown(row.unit)
            for axis, (trajectory, _) in zip(line, shown, strict=True):
                _draw(axis, diagnosis, row, trajectory, factor, extended=extended)
            _limits(line[0], row, factor)
            what = row.name if row.signed else f"{row.name}, rms"
            line[0].set_ylabel(f"{what}\n[{unit or '1'}]", fontsize=8.5)
        for axis, (trajectory, name) in zip(axes[0], shown, strict=True):
            _name_phases(axis, samples, trajectory)
            if len(shown) > 1:
                axis.set_title(name, fontsize=9.5, color=css(palette.INK), pad=14)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
        handles, labels = axes[0][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="lower center", ncols=3)
        figure.align_ylabels(list(axes[:, 0]))
        return svg_text(figure, "Difference between measurement and simulation over time")


def _draw(
    axis: Axes, diagnosis: Diagnosis, row: Row, trajectory: int, factor: float, *, extended: bool
) -> None:
    samples = diagnosis.samples
    for index, (begin_s, end_s, _) in enumerate(phase_spans(samples, trajectory)):
        axis.axvspan(begin_s, end_s, color=_PHASES[index % 2], linewidth=0, zorder=0)
    low = -2 * row.noise_sd if row.signed else 0.0
    high = (2 if row.signed else 1) * row.noise_sd
    axis.axhspan(
        factor * low, factor * high, color="#9fb3a6", alpha=0.4, linewidth=0, label="sensor noise"
    )
    time_s, before = curve(samples, row, trajectory, diagnosis.held_out_before)
    axis.plot(time_s, factor * before, color=_BEFORE, linewidth=1.3, label="simulation as it was")
    if extended:
        time_s, after = curve(samples, row, trajectory, diagnosis.held_out_after)
        axis.plot(time_s, factor * after, color=_AFTER, linewidth=1.3, label="extended simulation")
    axis.grid(visible=False, axis="x")
    if len(time_s):
        axis.set_xlim(time_s[0], max(time_s[-1], time_s[0] + 1e-9))


def _limits(axis: Axes, row: Row, factor: float) -> None:
    low, high = axis.get_ylim()
    least = 3 * factor * row.noise_sd
    if row.signed:
        most = max(abs(low), abs(high), least)
        axis.set_ylim(-most, most)
    else:
        axis.set_ylim(0, max(high, least))


def phase_spans(samples: Samples, trajectory: int) -> list[tuple[float, float, str]]:
    """Begin, end and name of every phase of a trajectory, in order; without gaps between.

    None where each channel has phases of its own, as joints that turn round at their own times.
    """
    chosen = samples.trajectory == trajectory
    times, first, at = np.unique(samples.time_s[chosen], return_index=True, return_inverse=True)
    if not len(times):
        return []
    phase: Integers = samples.phase[chosen][first]
    if np.any(samples.phase[chosen] != phase[at]):
        return []
    starts = np.flatnonzero(np.diff(phase, prepend=phase[0] - 1))
    ends = [*times[starts[1:]], times[-1]]
    return [
        (float(times[begin]), float(end), samples.phases[phase[begin]])
        for begin, end in zip(starts, ends, strict=True)
    ]


def _name_phases(axis: Axes, samples: Samples, trajectory: int) -> None:
    spans = phase_spans(samples, trajectory)
    total_s = spans[-1][1] - spans[0][0] if spans else 0.0
    for begin_s, end_s, name in spans:
        if end_s - begin_s > 0.012 * total_s * len(name):
            axis.text(
                (begin_s + end_s) / 2,
                1.03,
                name,
                ha="center",
                va="bottom",
                fontsize=8.5,
                color="#5c6672",
                transform=axis.get_xaxis_transform(),
            )


def _duration_s(samples: Samples, trajectory: int) -> float:
    return float(np.ptp(samples.time_s[samples.trajectory == trajectory]))
