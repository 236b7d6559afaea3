"""Ranking: what every candidate would explain, linearised, with everything else re-tuned first.

Base parameters, accepted causes and nuisances are fitted along; a nuisance that is itself the
candidate is judged against the model without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from defras_bt.diagnosis.columns import Option, Sketch
from defras_bt.diagnosis.diagnosis import Ranked, RankedPair
from defras_bt.diagnosis.held_out import Bounded, Loss, Products, losses, products
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats

_INVISIBLE = 1e-4
"""Share of whitened squares per sample below which a column changes nothing."""


@dataclass(frozen=True)
class Board:
    """Columns of the present model, of nuisances and of every option, side by side.

    ``always``: columns that are fitted along in any case. ``of_option``: columns of each option of
    each candidate; ``nuisance``: columns of each nuisance.
    """

    columns: Floats
    fold: Integers
    always: Integers
    nuisance: dict[str, Integers]
    of_option: dict[str, tuple[tuple[Option, Integers], ...]]

    def null(self, key: str) -> Integers:
        """Columns that candidate ``key`` is compared without and with."""
        others = [index for name, index in self.nuisance.items() if name != key]
        return np.concatenate([self.always, *others]) if others else self.always


def board(sketch: Sketch, jacobian: Floats, fold: Integers, keys: Sequence[str]) -> Board:
    """Candidates ``keys`` of a sketch beside a fitted model's ``jacobian`` (n, k)."""
    stack = [jacobian]
    count = jacobian.shape[1]
    of_option: dict[str, tuple[tuple[Option, Integers], ...]] = {}
    nuisance: dict[str, Integers] = {}
    for key in keys:
        placed = []
        for option in sketch.options[key]:
            width = option.columns.shape[1]
            placed.append((option, np.arange(count, count + width)))
            stack.append(option.columns)
            count += width
        of_option[key] = tuple(placed)
        if placed and sketch.candidate(key).nuisance:
            nuisance[key] = placed[0][1]
    return Board(
        np.concatenate(stack, axis=1), fold, np.arange(jacobian.shape[1]), nuisance, of_option
    )


@dataclass(frozen=True)
class Scores:
    """By candidate key: ``null`` and ``best`` loss of its best option (index ``option``), for
    every residual (s,)."""

    null: dict[str, Floats]
    best: dict[str, Floats]
    option: dict[str, Integers]

    def statistic(self, key: str) -> Floats:
        """Held-out loss that it removes, relative to what is left (s,)."""
        return np.asarray((self.null[key] - self.best[key]) / self.best[key])

    def largest(self) -> Floats:
        """The best candidate's statistic (s,)."""
        return np.max([self.statistic(key) for key in self.best], axis=0)


def score(board: Board, found: Products, *, held_out: bool = True) -> Scores:
    """Judge all candidates on all residuals of ``found``, held out or as fitted."""
    null: dict[str, Floats] = {}
    best: dict[str, Floats] = {}
    chosen: dict[str, Integers] = {}
    known: dict[bytes, Floats] = {}

    def loss_of(loss: Loss) -> Floats:
        return loss.total if held_out else loss.fitted

    for key, placed in board.of_option.items():
        without = board.null(key)
        name = without.tobytes()
        if name not in known:
            known[name] = loss_of(losses(found, without))
        null[key] = known[name]
        tried = [
            loss_of(losses(found, np.concatenate((without, index)), bounds_of(option, index)))
            for option, index in placed
        ]
        if not tried:
            best[key] = null[key]
            chosen[key] = np.zeros(len(null[key]), dtype=np.int64)
            continue
        chosen[key] = np.argmin(tried, axis=0)
        best[key] = np.min(tried, axis=0)
    return Scores(null, best, chosen)


def bounds_of(option: Option, index: Integers) -> tuple[Bounded, ...]:
    """Amplitude bounds of an option whose columns are at ``index``."""
    return tuple(
        Bounded(int(i), float(lower), float(upper))
        for i, lower, upper in zip(index, option.lower, option.upper, strict=True)
    )


def start_of(board: Board, found: Products, key: str, option: int) -> tuple[Option, Floats]:
    """An option of a candidate and its fitted amplitudes on the first residual."""
    chosen, index = board.of_option[key][option]
    without = board.null(key)
    loss = losses(found, np.concatenate((without, index)), bounds_of(chosen, index))
    return chosen, np.asarray(loss.amplitudes[len(without) :, 0])


def starts_of(
    board: Board, found: Products, key: str, most: int = 3
) -> list[tuple[Option, Floats]]:
    """Options of a candidate with their fitted amplitudes, the best held out first, at most
    ``most``: of those that step equally far one only."""
    without = board.null(key)
    best: dict[tuple[tuple[str, float], ...], tuple[float, Option, Floats]] = {}
    for option, index in board.of_option[key]:
        loss = losses(found, np.concatenate((without, index)), bounds_of(option, index))
        size = tuple(sorted(option.tangent.steps[0].items()))
        held_out = float(loss.total[0])
        if size not in best or held_out < best[size][0]:
            best[size] = (held_out, option, np.asarray(loss.amplitudes[len(without) :, 0]))
    ordered = sorted(best.values(), key=lambda one: one[0])
    return [(option, amplitudes) for _, option, amplitudes in ordered[:most]]


def remainder(
    board: Board, found: Products, residual: Floats, key: str, option: int | None
) -> Floats:
    """``residual`` (n,) less what others than candidate ``key`` and, with one of its options, what
    they and it together explain of it."""
    index = board.null(key)
    bounds: tuple[Bounded, ...] = ()
    if option is not None:
        chosen, own = board.of_option[key][option]
        index = np.concatenate((index, own))
        bounds = bounds_of(chosen, own)
    loss = losses(found, index, bounds)
    return np.asarray(residual - board.columns[:, index] @ loss.amplitudes[:, 0])


def ranked(board: Board, sketch: Sketch, found: Products) -> tuple[Ranked, ...]:
    """All candidates on the first residual, the best held out first."""
    fitted, held_out = score(board, found, held_out=False), score(board, found)
    rows = []
    for key in board.of_option:
        start: dict[str, float] = {}
        if board.of_option[key]:
            option, amplitudes = start_of(board, found, key, int(held_out.option[key][0]))
            start = option.tangent.values(amplitudes, sketch.candidate(key).free)
        rows.append(
            Ranked(
                key,
                float(1.0 - fitted.best[key][0] / max(fitted.null[key][0], 1e-300)),
                float(held_out.statistic(key)[0]),
                key not in unseen(board, found),
                start,
            )
        )
    return tuple(sorted(rows, key=lambda row: -row.held_out))


def ranked_pairs(board: Board, found: Products, best: Sequence[str]) -> tuple[RankedPair, ...]:
    """Pairs of the candidates ``best`` (with their best options), the best pair first."""
    scores = score(board, found)
    rows = []
    null = losses(found, board.null("")).fitted
    for first, second in combinations([key for key in best if board.of_option[key]], 2):
        index = [board.null("")]
        for key in (first, second):
            own = board.of_option[key][int(scores.option[key][0])][1]
            if key not in board.nuisance:
                index.append(own)
        loss = losses(found, np.unique(np.concatenate(index)))
        rows.append(RankedPair((first, second), float(1.0 - loss.fitted[0] / null[0])))
    return tuple(sorted(rows, key=lambda row: -row.gain))


def alike(board: Board, found: Products, first: str, second: str) -> float:
    """Largest cosine between whitened columns of two candidates, the present model projected
    out."""
    gram = found.gram.sum(axis=0)
    model = gram[np.ix_(board.always, board.always)] + np.eye(len(board.always))
    one, other = (
        np.concatenate([own for _, own in board.of_option[key]]) for key in (first, second)
    )

    def left(a: Integers, b: Integers) -> Floats:
        across = gram[np.ix_(board.always, b)]
        return np.asarray(
            gram[np.ix_(a, b)] - gram[np.ix_(a, board.always)] @ np.linalg.solve(model, across)
        )

    sizes = np.sqrt(np.outer(np.diag(left(one, one)), np.diag(left(other, other))))
    return float((np.abs(left(one, other)) / np.maximum(sizes, 1e-300)).max())


def unseen(board: Board, found: Products) -> tuple[str, ...]:
    """Candidates none of whose options changes any number by an amount that could be seen."""
    gram = found.gram.sum(axis=0)
    samples = board.columns.shape[0]
    result = []
    for key, placed in board.of_option.items():
        largest = 0.0
        for option, index in placed:
            reach = np.minimum(np.maximum(-option.lower, option.upper), 10.0)
            largest = max(largest, float((np.diag(gram)[index] * reach**2).max()))
        if largest < _INVISIBLE * samples:
            result.append(key)
    return tuple(result)


def whitened_products(board: Board, noise: Noise, residuals: Floats) -> Products:
    """Inner products for ``residuals`` (n, s) under ``noise``."""
    return products(noise.whiten(board.columns), noise.whiten(residuals), board.fold)
