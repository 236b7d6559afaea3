"""What others would do with the same problem, to be measured beside the engine.

All four look at the linearised candidates one at a time, as the textbooks do: residuals are taken
as independent, nuisances and base are fitted along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import f as f_distribution

from defras_bt.diagnosis.columns import Sketch, sketch
from defras_bt.diagnosis.held_out import losses, products
from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Problem, Samples
from defras_bt.diagnosis.ranking import Board, board, bounds_of
from defras_sim.geometry import Floats

BaselineName = Literal["median distance", "F-test", "BIC", "ridge on the residual"]
BASELINES: tuple[BaselineName, ...] = ("median distance", "F-test", "BIC", "ridge on the residual")

_SIGNIFICANT = 0.01
_BIC_DIFFERENCE = 10.0
_RIDGE_SHARE = 0.05


@dataclass(frozen=True)
class BaselineVerdict:
    """``alarm``: something is said to be wrong; ``named``: the candidate's key, None where the
    approach has no names. ``removed``: share of held-out squares that its correction removes."""

    alarm: bool
    named: str | None
    removed: float | None


def asked_of_baselines(problem: Problem) -> dict[BaselineName, BaselineVerdict]:
    """What each approach says of ``problem``."""
    samples = problem.samples
    residual = np.asarray(problem.residual({}), dtype=float)
    candidates = sketch(problem, {}, problem.candidates)
    return {
        "median distance": _median(residual, samples),
        "F-test": _one_at_a_time("F-test", residual, candidates, samples),
        "BIC": _one_at_a_time("BIC", residual, candidates, samples),
        "ridge on the residual": _ridge(residual, candidates, samples),
    }


def _median(residual: Floats, samples: Samples) -> BaselineVerdict:
    """The paper's monitor: the median distance above what the sensors scatter and the floor."""
    limit = tolerances(samples)[samples.channel]
    # Of a normal distribution, half lies within 0.6745 standard deviations.
    return BaselineVerdict(bool(np.nanmedian(np.abs(residual) / limit) > 2.0 * 0.6745), None, None)


def _independent(
    residual: Floats, candidates: Sketch, samples: Samples
) -> tuple[Board, Floats, Floats]:
    """Board, its columns and the residual (n, 1), in units of their channel's scatter."""
    keys = [c.key for c in candidates.candidates]
    now = board(candidates, np.zeros((len(residual), 0)), samples.fold, keys)
    seen = np.isfinite(residual)
    scale = np.ones(len(samples.channels))
    for index in range(len(scale)):
        own = residual[seen & (samples.channel == index)]
        if len(own):
            scale[index] = max(float(own.std()), 1e-12)
    weight = (seen / scale[samples.channel])[:, None]
    return now, now.columns * weight, np.nan_to_num(residual)[:, None] * weight


def _one_at_a_time(
    name: BaselineName, residual: Floats, candidates: Sketch, samples: Samples
) -> BaselineVerdict:
    """The most significant candidate by a Bonferroni-corrected F-test, or by Schwarz (BIC)."""
    now, columns, target = _independent(residual, candidates, samples)
    found = products(columns, target, samples.fold)
    count = int(np.isfinite(residual).sum())
    own = [c for c in candidates.candidates if not c.base and now.of_option[c.key]]
    best: tuple[float, str] | None = None
    alarm = False
    for candidate in own:
        without = now.null(candidate.key)
        null = float(losses(found, without).fitted[0])
        for option, index in now.of_option[candidate.key]:
            chosen = np.concatenate((without, index))
            left = float(losses(found, chosen, bounds_of(option, index)).fitted[0])
            if name == "F-test":
                freedom = count - len(chosen)
                statistic = (null - left) / len(index) / (left / freedom)
                chance = float(f_distribution.sf(statistic, len(index), freedom))
                evidence = statistic
                alarm = alarm or chance < _SIGNIFICANT / len(own)
            else:
                evidence = count * np.log(null / left) - len(index) * np.log(count)
                alarm = alarm or evidence > _BIC_DIFFERENCE
            if best is None or evidence > best[0]:
                best = (evidence, candidate.key)
    return BaselineVerdict(alarm, best[1] if alarm and best is not None else None, None)


def _ridge(residual: Floats, candidates: Sketch, samples: Samples) -> BaselineVerdict:
    """A nameless correction: ridge regression of the residual on all columns at once, its penalty
    by held-out squares."""
    now, columns, target = _independent(residual, candidates, samples)
    size = np.sqrt((columns**2).sum(axis=0))
    columns = columns[:, size > 0.0] / size[size > 0.0]
    found = products(columns, target, now.fold)
    gram, cross = found.gram.sum(axis=0), found.cross.sum(axis=0)[:, 0]
    least = float(found.total[0])
    for penalty in np.logspace(-4, 2, 13):
        total = 0.0
        for part_gram, part_cross, square in zip(
            found.gram, found.cross[:, :, 0], found.square[:, 0], strict=True
        ):
            amplitudes = np.linalg.solve(
                gram - part_gram + penalty * np.eye(len(gram)), cross - part_cross
            )
            total += float(
                square - 2.0 * amplitudes @ part_cross + amplitudes @ part_gram @ amplitudes
            )
        least = min(least, total)
    removed = 1.0 - least / float(found.total[0])
    return BaselineVerdict(removed > _RIDGE_SHARE, None, removed)
