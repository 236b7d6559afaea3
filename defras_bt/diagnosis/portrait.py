"""Portrait of a residual: numbers that make kinds of causes visible, each with a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from defras_bt.diagnosis.diagnosis import Statistic
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.portrait_measures import (
    Measure,
    drifts,
    jumps,
    lines,
    means,
    reversals,
    slopes,
)
from defras_bt.diagnosis.portrait_patterns import patterns
from defras_bt.diagnosis.problem import Covariate, Samples
from defras_bt.diagnosis.surrogates import surrogates
from defras_sim.geometry import Floats

_SURROGATES = 60
_CHANCE = 0.95
_FEW = 8
"""Channels of a sensor up to which each is described; of more, those that stand out most."""


def portrait(
    residual: Floats,
    samples: Samples,
    found: Layout,
    noise: Noise,
    left: Floats,
    covariates: Sequence[Covariate],
    rng: np.random.Generator,
) -> tuple[Statistic, ...]:
    """Statistics of ``residual`` (n,), NaN where nothing is compared, the most conspicuous first.

    Chance is what noise as in ``left`` (n,) gives, the residual of the best model, from which
    ``noise`` was estimated.
    """
    spread = [*_spreads(residual, samples)]
    seen = np.flatnonzero(noise.seen)
    drawn = [np.where(noise.seen, residual, 0.0)[:, None]]
    drawn += surrogates(noise, left, _SURROGATES, rng)
    together = np.concatenate(drawn, axis=1)
    measures: list[Measure] = [
        *means(samples, seen),
        *drifts(samples, seen, found),
        *jumps(samples, seen, found),
        *lines(samples, seen, found),
        *patterns(samples, found),
    ]
    for covariate in covariates:
        measures += reversals(samples, seen, found, covariate)
        measures += slopes(samples, seen, found, covariate)
    judged = [_judged(measure, together) for measure in measures]
    return (*spread, *_telling(judged))


def _spreads(residual: Floats, samples: Samples) -> Iterator[Statistic]:
    """Root mean square by sensor, in all and by phase."""
    for sensor in dict.fromkeys(channel.sensor for channel in samples.channels):
        own = [i for i, channel in enumerate(samples.channels) if channel.sensor == sensor]
        unit = samples.channels[own[0]].unit
        noise = float(np.sqrt(np.mean([samples.channels[i].noise_sd ** 2 for i in own])))
        rows = np.isin(samples.channel, own) & np.isfinite(residual)
        for phase in (None, *range(len(samples.phases))):
            values = residual[rows if phase is None else rows & (samples.phase == phase)]
            if not len(values):
                continue
            rms = float(np.sqrt(np.mean(values**2)))
            name = "" if phase is None else samples.phases[phase]
            when = f" during {name}" if name else ""
            yield Statistic(
                "rms",
                sensor,
                rms,
                unit,
                f"{sensor} differs from the simulation by {_number(rms, unit)}{when} (root mean "
                f"square); it scatters by {_number(noise, unit)} by itself.",
                phase=name,
            )


def _judged(measure: Measure, residuals: Floats) -> Statistic:
    """The first of ``residuals`` (n, 1+s) by a measure, beside the others."""
    values = measure.of(residuals)
    chance = float(np.quantile(np.abs(values[1:]), _CHANCE))
    value = float(values[0])
    shown = _number(abs(value), measure.unit)
    sentence = measure.says.format(shown)
    return Statistic(
        measure.kind,
        measure.sensor,
        value,
        measure.unit,
        f"{sentence[:-1]} (by chance up to {_number(chance, measure.unit)}).",
        chance,
        measure.channel,
        measure.phase,
    )


def _telling(found: list[Statistic]) -> list[Statistic]:
    """Of each kind and sensor the most conspicuous, those that stand out first."""

    def conspicuous(one: Statistic) -> float:
        return abs(one.value) / max(one.chance or 0.0, 1e-300)

    kept: dict[tuple[str, str], int] = {}
    chosen = []
    for one in sorted(found, key=conspicuous, reverse=True):
        kept[one.kind, one.sensor] = kept.get((one.kind, one.sensor), 0) + 1
        if kept[one.kind, one.sensor] <= _FEW:
            chosen.append(one)
    return chosen


def _number(value: float, unit: str) -> str:
    """As people read it: lengths in millimetres, angles in degrees, shares in percent."""
    if unit == "m":
        return f"{value * 1e3:.3g} mm"
    if unit == "rad":
        return f"{np.degrees(value):.3g}°"
    if unit == "":
        return f"{100.0 * value:.0f} %"
    return f"{value:.3g} {unit}"
