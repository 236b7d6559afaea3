"""What a selection has found so far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from defras_bt.diagnosis.columns import Sketch
from defras_bt.diagnosis.diagnosis import Ranked, RankedPair, Round
from defras_bt.diagnosis.fitted import CountedProblem, Fit, conflicts
from defras_bt.diagnosis.fitting import without
from defras_bt.diagnosis.layout import Layout
from defras_bt.diagnosis.noise import Noise
from defras_bt.diagnosis.noise_search import Chosen
from defras_bt.diagnosis.predicted_folds import HeldOut, hold_out
from defras_bt.diagnosis.problem import Approximating, Foreseeing, Samples
from defras_bt.diagnosis.ranking import Board, board
from defras_bt.diagnosis.settings import Settings
from defras_sim.geometry import Floats

Progress = Callable[[str, float], None]
"""Is told a sentence and the share of it that is done."""


@dataclass
class Search:
    """What the selection has found so far; kept up to date, so that an interrupted search can be
    reported. ``fitted_with``: as if the noise were this parameters were fitted in the end, where
    that predicts better than ``noise``. ``was_cut_short``: before every candidate had its turn.
    ``approached``: what the twin may be off by has changed since chance was measured last.
    ``doubted``: causes that may as well be absent, and are not tried again."""

    counted: CountedProblem
    samples: Samples
    layout: Layout
    sketch: Sketch
    settings: Settings
    rng: np.random.Generator
    fit: Fit
    noise: Noise
    fitted_with: Noise | None = None
    removed: Chosen = ()
    fits: dict[str, dict[str, Fit]] = field(default_factory=dict)
    rounds: list[Round] = field(default_factory=list)
    ranking: tuple[Ranked, ...] = ()
    pairs: tuple[RankedPair, ...] = ()
    was_cut_short: bool = False
    approached: bool = False
    doubted: tuple[str, ...] = ()

    def accepted(self) -> tuple[str, ...]:
        """Candidates of the present model that are not base."""
        return tuple(c.key for c in self.fit.candidates if not c.base)

    @property
    def is_spent(self) -> bool:
        """Whether a twin that takes long has predicted as often as it may; what was found by then
        is settled and said."""
        long = isinstance(self.counted.problem, Foreseeing)
        return long and self.counted.calls >= self.settings.predictions

    def open_keys(self) -> tuple[str, ...]:
        """Candidates that could still be added, and nuisances that are not in the model."""
        return tuple(
            c.key
            for c in self.sketch.candidates
            if not c.base
            and c.key not in self.doubted
            and not any(conflicts(c, other) for other in self.fit.candidates)
        )

    def nuisance_columns(self, *without: str) -> Floats:
        """Columns (n, k) of nuisances that are not in the model."""
        inside = {c.key for c in self.fit.candidates}
        options = self.sketch.nuisances(*without, *inside)
        size = len(self.samples.time_s)
        return np.concatenate([np.zeros((size, 0)), *[o.columns for o in options]], axis=1)

    def held_out(self, fit: Fit, noise: Noise, *without: str) -> HeldOut:
        """``fit`` with every fold predicted from the others, strengths and nuisances re-tuned."""
        columns = self.tuned_columns(fit, *without)
        kept = sum(p.is_tuned for _, p in fit.free)
        return hold_out(fit.residual, columns, noise, self.samples.fold, kept, self.fitted_with)

    def tuned_columns(self, fit: Fit, *without: str) -> Floats:
        """Columns (n, k) of what is re-tuned in other data: strengths and amounts, then nuisances.

        Where and when something is stays as it was fitted, as it does where chance is measured:
        what is seen in one fold alone cannot be found without it.
        """
        tuned = np.array([p.is_tuned for _, p in fit.free], dtype=bool)
        return np.concatenate((fit.jacobian[:, tuned], self.nuisance_columns(*without)), axis=1)

    def approximations(self, count: int) -> Floats | None:
        """Draws (n, count) of what the twin itself may be off by, where it is known."""
        problem = self.counted.problem
        if not isinstance(problem, Approximating):
            return None
        return problem.approximations(count, self.rng)

    def stand(self) -> None:
        """Have the twin stand at the present model, and the fit see what that changes."""
        if self.counted.approach(self.fit.model):
            self.fit = replace(self.fit, residual=self.counted.residual(self.fit.model))

    def take_out(self, key: str) -> None:
        """Remove an accepted cause, and fit the others anew."""
        weighing = self.fitted_with or self.noise
        rounds = self.settings.iterations
        self.fit = without(self.counted, self.fit, key, weighing, iterations=rounds)
        self.stand()
        self.rounds.append(
            Round((), self.rounds[-1].threshold if self.rounds else 0.0, None, removed=key)
        )

    def put_instead(self, key: str, other: str, fit: Fit) -> None:
        """``fit``, in which ``other`` takes the place of the accepted cause ``key``."""
        self.fit = fit
        tried = self.fits.get(key, {})
        # Rivals of the same round count as such only if it was tried in that round itself.
        self.fits[other] = tried if other in tried else {}
        self.stand()
        threshold = self.rounds[-1].threshold if self.rounds else 0.0
        self.rounds.append(Round((), threshold, other, removed=key))


def board_of(search: Search) -> Board:
    """Candidates that are still open, beside the present model."""
    return board(search.sketch, search.fit.jacobian, search.samples.fold, search.open_keys())
